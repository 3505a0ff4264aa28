// A map in three dimensions, drawn by a small rasteriser of our own: no library, and no GPU needed.

import { RISE } from "./map_view.js";
import { fitted } from "./overlay.js";

const ACROSS = 100; // nodes along the longer side
const START = { turn: -0.55, tilt: 0.95 };

export class SolidView {
  constructor(canvas, onTurn) {
    this.canvas = canvas;
    this.onTurn = onTurn;
    this.reset();
    this.buffer = document.createElement("canvas");
    canvas.addEventListener("pointerdown", (event) => this.#grab(event));
    canvas.addEventListener("keydown", (event) => this.#key(event));
  }

  reset() {
    Object.assign(this, START);
  }

  // colours: the 32-bit pixels of the map, as its own view has drawn them
  draw(map, { low, high }, colours, size) {
    if (!fitted(this.canvas, size[0] / size[1])) return;
    const width = Math.min(this.canvas.width, 560);
    const height = Math.round((width * size[1]) / size[0]);
    if (this.buffer.width !== width || this.buffer.height !== height) {
      this.buffer.width = width;
      this.buffer.height = height;
      this.image = new ImageData(width, height);
      this.pixels = new Uint32Array(this.image.data.buffer);
      this.depths = new Float32Array(width * height);
    }
    this.pixels.fill(0);
    this.depths.fill(-Infinity);
    this.#mesh(map, low, high, colours);
    this.#fill();
    this.buffer.getContext("2d").putImageData(this.image, 0, 0);
    const context = this.canvas.getContext("2d");
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    context.drawImage(this.buffer, 0, 0, this.canvas.width, this.canvas.height);
  }

  #mesh(map, low, high, colours) {
    const step = Math.max(map.width, map.height) / ACROSS;
    const columns = Math.min(Math.max(2, Math.floor(map.width / step)), map.width);
    const rows = Math.min(Math.max(2, Math.floor(map.height / step)), map.height);
    const count = rows * columns;
    if (this.count !== count) {
      Object.assign(this, {
        count, x: new Float32Array(count), y: new Float32Array(count),
        z: new Float32Array(count), colour: new Uint32Array(count),
      });
    }
    Object.assign(this, { rows, columns });
    const { width, height } = this.buffer;
    const [cosTurn, sinTurn] = [Math.cos(this.turn), Math.sin(this.turn)];
    const [cosTilt, sinTilt] = [Math.cos(this.tilt), Math.sin(this.tilt)];
    const aspect = map.height / map.width;
    const wide = Math.abs(cosTurn) + Math.abs(sinTurn) * aspect;
    const deep = (Math.abs(sinTurn) + Math.abs(cosTurn) * aspect) * cosTilt + RISE * sinTilt;
    const scale = 0.94 * Math.min(width / wide, height / deep);
    const unit = (map.high - map.low) / 65535 / (high - low);
    const base = (map.low - low) / (high - low);
    for (let i = 0, n = 0; i < rows; i++) {
      const row = Math.round((i * (map.height - 1)) / (rows - 1));
      for (let j = 0; j < columns; j++, n++) {
        const column = Math.round((j * (map.width - 1)) / (columns - 1));
        const at = row * map.width + column;
        const x = column / (map.width - 1) - 0.5;
        const y = (row / (map.height - 1) - 0.5) * aspect;
        const z = (map.values[at] * unit + base) * RISE;
        const across = x * cosTurn - y * sinTurn;
        const away = x * sinTurn + y * cosTurn;
        this.x[n] = width / 2 + scale * across;
        this.y[n] = height / 2 + scale * (away * cosTilt - (z - RISE / 2) * sinTilt);
        this.z[n] = away * sinTilt + z * cosTilt;
        this.colour[n] = colours[at];
      }
    }
  }

  #fill() {
    const { rows, columns } = this;
    for (let i = 0; i + 1 < rows; i++) {
      for (let j = 0; j + 1 < columns; j++) {
        const n = i * columns + j;
        this.#triangle(n, n + 1, n + columns);
        this.#triangle(n + 1, n + columns + 1, n + columns);
      }
    }
  }

  #triangle(a, b, c) {
    const { x, y, z, pixels, depths, colour } = this;
    const { width, height } = this.buffer;
    const area = (x[b] - x[a]) * (y[c] - y[a]) - (x[c] - x[a]) * (y[b] - y[a]);
    if (Math.abs(area) < 1e-9) return;
    const left = Math.max(0, Math.floor(Math.min(x[a], x[b], x[c])));
    const right = Math.min(width - 1, Math.ceil(Math.max(x[a], x[b], x[c])));
    const top = Math.max(0, Math.floor(Math.min(y[a], y[b], y[c])));
    const bottom = Math.min(height - 1, Math.ceil(Math.max(y[a], y[b], y[c])));
    const inverse = 1 / area;
    const stepB = (y[c] - y[a]) * inverse;
    const stepC = -(y[b] - y[a]) * inverse;
    const shown = colour[a];
    for (let v = top; v <= bottom; v++) {
      let wb = ((left - x[a]) * (y[c] - y[a]) - (x[c] - x[a]) * (v - y[a])) * inverse;
      let wc = ((x[b] - x[a]) * (v - y[a]) - (left - x[a]) * (y[b] - y[a])) * inverse;
      for (let u = left, at = v * width + left; u <= right; u++, at++, wb += stepB, wc += stepC) {
        if (wb < -1e-3 || wc < -1e-3 || wb + wc > 1.001) continue;
        const depth = z[a] + wb * (z[b] - z[a]) + wc * (z[c] - z[a]);
        if (depth <= depths[at]) continue;
        depths[at] = depth;
        pixels[at] = shown;
      }
    }
  }

  #turnBy(turn, tilt) {
    this.turn += turn;
    this.tilt = Math.min(Math.max(this.tilt + tilt, 0.05), 1.45);
    this.onTurn();
  }

  #grab(event) {
    this.canvas.setPointerCapture(event.pointerId);
    let [x, y] = [event.clientX, event.clientY];
    const move = (moved) => {
      this.#turnBy(-(moved.clientX - x) / 150, (y - moved.clientY) / 200);
      [x, y] = [moved.clientX, moved.clientY];
    };
    this.canvas.addEventListener("pointermove", move);
    const end = () => this.canvas.removeEventListener("pointermove", move);
    this.canvas.addEventListener("pointerup", end, { once: true });
    this.canvas.addEventListener("pointercancel", end, { once: true });
  }

  #key(event) {
    const turns = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
    const turn = turns[event.key];
    if (!turn) return;
    event.preventDefault();
    this.#turnBy(...turn);
  }
}
