// Numbers over the last seconds.

const LENGTH_S = 30;

export function shownNumber(value, unit) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (typeof value === "boolean") return value ? "yes" : "no";
  if (typeof value === "string") return value;
  if (Array.isArray(value)) return `${value.length} values`;
  const size = Math.abs(value);
  const digits = Number.isInteger(value) ? 0 : size >= 100 ? 1 : size >= 1 ? 2 : 3;
  return `${value.toFixed(digits).replace("-", "−")}${unit ? `\u202f${unit}` : ""}`;
}

// The samples of all numbers, by key.
export class History {
  constructor() {
    this.clear();
  }

  clear() {
    this.series = new Map();
    this.newest = 0;
  }

  add(keys, rows) {
    const width = keys.length + 1;
    for (let at = 0; at < rows.length; at += width) {
      const time = rows[at];
      if (time < this.newest) this.clear();
      this.newest = time;
      keys.forEach((key, column) => {
        let line = this.series.get(key);
        if (!line) this.series.set(key, (line = { times: [], values: [], first: 0 }));
        line.times.push(time);
        line.values.push(rows[at + column + 1]);
        while (line.times[line.first] < time - LENGTH_S) line.first++;
        if (line.first > 2000) {
          line.times.splice(0, line.first);
          line.values.splice(0, line.first);
          line.first = 0;
        }
      });
    }
  }
}

export class Plot {
  constructor(title, unit) {
    this.unit = unit;
    this.element = document.createElement("div");
    this.element.className = "plot";
    const head = document.createElement("header");
    const name = document.createElement("span");
    name.textContent = title;
    this.value = document.createElement("b");
    head.append(name, this.value);
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `${title} over the last ${LENGTH_S} seconds`);
    this.element.append(head, this.canvas);
  }

  draw(line, newest, colours) {
    const { canvas } = this;
    const ratio = Math.min(devicePixelRatio, 2);
    const width = Math.round(canvas.clientWidth * ratio);
    const height = Math.round(canvas.clientHeight * ratio);
    if (!width || !line) return;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    let low = 0, high = -Infinity;
    for (let i = line.first; i < line.values.length; i++) {
      const value = line.values[i];
      if (value < low) low = value;
      if (value > high) high = value;
    }
    if (!(high > low)) high = low + 1e-3;
    const last = line.values.at(-1);
    this.value.textContent = shownNumber(Number.isInteger(last) ? last : last, this.unit);
    const context = canvas.getContext("2d");
    context.clearRect(0, 0, width, height);
    const margin = 4 * ratio;
    const y = (value) => height - margin - ((value - low) / (high - low)) * (height - 2 * margin);
    const x = (time) => width * (1 - (newest - time) / LENGTH_S);
    context.strokeStyle = colours.line;
    context.lineWidth = ratio;
    context.beginPath();
    context.moveTo(0, y(0));
    context.lineTo(width, y(0));
    context.stroke();
    context.beginPath();
    let drawing = false;
    const stride = Math.max(1, Math.floor((line.values.length - line.first) / (width / ratio)));
    for (let i = line.first; i < line.values.length; i += stride) {
      const value = line.values[i];
      if (Number.isNaN(value)) drawing = false;
      else if (drawing) context.lineTo(x(line.times[i]), y(value));
      else {
        context.moveTo(x(line.times[i]), y(value));
        drawing = true;
      }
    }
    context.strokeStyle = colours.accent;
    context.lineWidth = 1.6 * ratio;
    context.lineJoin = "round";
    context.stroke();
    context.fillStyle = colours.soft;
    context.font = `${10 * ratio}px system-ui, sans-serif`;
    context.fillText(shownNumber(high, ""), 4 * ratio, 11 * ratio);
  }
}
