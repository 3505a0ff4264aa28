// A websocket that is opened again when the server comes back.

const FIRST_MS = 250;
const LONGEST_MS = 4000;

export class Connection {
  constructor(address, { onText, onBinary, onState }) {
    this.address = address;
    this.handlers = { onText, onBinary, onState };
    this.waitMs = FIRST_MS;
    this.open();
  }

  open() {
    const socket = new WebSocket(this.address);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.waitMs = FIRST_MS;
      this.handlers.onState("live");
    };
    socket.onmessage = (event) => {
      if (typeof event.data === "string") this.handlers.onText(JSON.parse(event.data));
      else this.handlers.onBinary(event.data);
    };
    socket.onclose = () => {
      this.handlers.onState("lost");
      setTimeout(() => this.open(), this.waitMs);
      this.waitMs = Math.min(2 * this.waitMs, LONGEST_MS);
    };
    this.socket = socket;
  }

  send(command) {
    if (this.socket.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(command));
    return true;
  }
}
