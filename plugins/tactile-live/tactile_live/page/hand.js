// Moves an object on a virtual sensor: by pointer, wheel and keys on the camera's picture.

const STEP_MM = 0.2;
const TWIST_DEG = 4;
const EVERY_MS = 33;

export class Hand {
  constructor(card, canvas, bar, hello) {
    this.canvas = canvas;
    this.hello = hello;
    this.send = (command) => card.connection.send(command);
    this.aim = { x_mm: 0, y_mm: 0, angle_deg: 0, depth_mm: 0.4, pressed: false };
    this.sentMs = 0;
    bar.hidden = false;
    canvas.classList.add("held");
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "application");
    canvas.setAttribute("aria-label", "Picture of the camera; arrow keys move the object, space presses it, Q and E twist it");
    this.depth = bar.querySelector(".depth");
    this.depthMm = bar.querySelector(".depth-mm");
    this.depth.max = hello.hand.deepest_mm.toFixed(2);
    this.depth.value = (hello.hand.deepest_mm / 2).toFixed(2);
    this.object = bar.querySelector(".object");
    this.size = bar.querySelector(".size");
    this.object.replaceChildren(...hello.hand.objects.map((name) => new Option(name, name)));
    // a third of the view is an object that fits and can be moved
    const view = Math.min(...hello.size) * hello.mm_per_px;
    this.size.value = Math.max(0.5, Math.round(view / 1.5) / 2);
    this.#readDepth();
    this.depth.addEventListener("input", () => this.#readDepth());
    for (const input of [this.object, this.size]) input.addEventListener("change", () => this.#take());
    canvas.addEventListener("pointerdown", (event) => this.#grab(event));
    canvas.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    canvas.addEventListener("keydown", (event) => this.#key(event));
    this.#take();
  }

  resend() {
    this.#take();
    this.#move(true);
  }

  // Draws where the object is aimed at.
  draw(context, scale, colours) {
    const { hello, aim } = this;
    const x = (aim.x_mm / hello.mm_per_px + hello.size[0] / 2) * scale;
    const y = (aim.y_mm / hello.mm_per_px + hello.size[1] / 2) * scale;
    const angle = (aim.angle_deg * Math.PI) / 180;
    context.save();
    context.translate(x, y);
    context.rotate(angle);
    context.strokeStyle = aim.pressed ? colours.mark : "rgb(255 255 255 / 80%)";
    context.lineWidth = 2;
    context.beginPath();
    context.arc(0, 0, 9, 0, 2 * Math.PI);
    context.moveTo(9, 0);
    context.lineTo(17, 0);
    context.stroke();
    context.restore();
  }

  #take() {
    const size = Number(this.size.value);
    if (size > 0) this.send({ do: "take", kind: this.object.value, size_mm: size });
  }

  #readDepth() {
    this.aim.depth_mm = Number(this.depth.value);
    this.depthMm.textContent = `${this.aim.depth_mm.toFixed(2)} mm`;
    if (this.aim.pressed) this.#move();
  }

  #move(now = false) {
    clearTimeout(this.later);
    const wait = this.sentMs + EVERY_MS - performance.now();
    if (!now && wait > 0) {
      this.later = setTimeout(() => this.#move(true), wait);
      return;
    }
    this.sentMs = performance.now();
    this.send({ do: "move", ...this.aim });
  }

  #place(event) {
    const box = this.canvas.getBoundingClientRect();
    const { size, mm_per_px } = this.hello;
    this.aim.x_mm = ((event.clientX - box.left) / box.width - 0.5) * size[0] * mm_per_px;
    this.aim.y_mm = ((event.clientY - box.top) / box.height - 0.5) * size[1] * mm_per_px;
    this.#within();
  }

  #within() {
    const { size, mm_per_px } = this.hello;
    const [right, bottom] = size.map((px) => (px * mm_per_px) / 2);
    this.aim.x_mm = Math.min(Math.max(this.aim.x_mm, -right), right);
    this.aim.y_mm = Math.min(Math.max(this.aim.y_mm, -bottom), bottom);
  }

  #grab(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.#place(event);
    this.aim.pressed = true;
    this.#move(true);
    const drag = (moved) => {
      this.#place(moved);
      this.#move();
    };
    const end = () => {
      this.canvas.removeEventListener("pointermove", drag);
      this.aim.pressed = false;
      this.#move(true);
    };
    this.canvas.addEventListener("pointermove", drag);
    this.canvas.addEventListener("pointerup", end, { once: true });
    this.canvas.addEventListener("pointercancel", end, { once: true });
  }

  #wheel(event) {
    event.preventDefault();
    this.aim.angle_deg += Math.sign(event.deltaY) * TWIST_DEG;
    this.#move();
  }

  #key(event) {
    const far = event.shiftKey ? 5 * STEP_MM : STEP_MM;
    const { aim } = this;
    const moves = {
      ArrowLeft: () => (aim.x_mm -= far), ArrowRight: () => (aim.x_mm += far),
      ArrowUp: () => (aim.y_mm -= far), ArrowDown: () => (aim.y_mm += far),
      q: () => (aim.angle_deg -= TWIST_DEG), e: () => (aim.angle_deg += TWIST_DEG),
      " ": () => (aim.pressed = !aim.pressed),
      "+": () => this.#deeper(1), "-": () => this.#deeper(-1),
    };
    const move = moves[event.key] || moves[event.key.toLowerCase()];
    if (!move) return;
    event.preventDefault();
    move();
    this.#within();
    this.#move();
  }

  #deeper(sign) {
    this.depth.value = Number(this.depth.value) + sign * 0.05;
    this.#readDepth();
  }
}
