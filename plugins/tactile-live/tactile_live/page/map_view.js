// A map of numbers: relief of a surface, or colours, with outlines and arrows.

import { SEQUENTIAL, colourMap, shadeRelief } from "./colours.js";
import { drawArrows, drawOverlays, fitted, magnification } from "./overlay.js";

const CALM = 0.97; // share of the range that is kept from one picture to the next
export const RISE = 0.22; // height of the range in three dimensions, as a share of the map's width
const MOST_TIMES = 10; // larger than life: a gel's noise of some hundredths of a millimetre stays flat

export function readMap(described, message) {
  const [height, width] = described.values.shape;
  return { ...described, values: message.array(described.values), width, height };
}

// The range of colours: never so narrow that noise looks like relief, and without jumps.
export class Range {
  constructor() {
    this.key = "";
  }

  follow(map, widthMm) {
    const least = map.kind === "surface" ? (RISE * widthMm) / MOST_TIMES : 1e-9;
    let low = map.kind === "scalars" ? map.low : Math.min(map.low, 0);
    let high = Math.max(map.high, low + least);
    if (this.key === map.key) {
      low = Math.min(low, low + (this.low - low) * CALM);
      high = Math.max(high, high + (this.high - high) * CALM);
    }
    Object.assign(this, { key: map.key, low, high });
    return this;
  }
}

export class MapView {
  constructor(canvas) {
    this.canvas = canvas;
    this.image = null;
    this.buffer = document.createElement("canvas");
  }

  // Returns the words about arrows, if there are any.
  draw(map, { low, high }, size, { overlays = [], message, colours }) {
    const { width, height } = map;
    if (!this.image || this.image.width !== width || this.image.height !== height) {
      this.image = new ImageData(width, height);
      this.pixels = new Uint32Array(this.image.data.buffer);
      this.buffer.width = width;
      this.buffer.height = height;
    }
    if (map.kind === "surface") shadeRelief(map, low, high, this.pixels);
    else colourMap(map, low, high, SEQUENTIAL, this.pixels);
    const context = fitted(this.canvas, size[0] / size[1]);
    if (!context) return "";
    this.buffer.getContext("2d").putImageData(this.image, 0, 0);
    context.imageSmoothingQuality = "medium";
    context.drawImage(this.buffer, 0, 0, this.canvas.width, this.canvas.height);
    const scale = this.canvas.width / size[0];
    let note = "";
    if (map.arrows && message) note = drawField(context, map, message, scale, colours);
    return drawOverlays(context, overlays, message, scale, colours) || note;
  }

  // The value under a pointer event, and its place in the image.
  probe(event, map, size) {
    const box = this.canvas.getBoundingClientRect();
    const x = (event.clientX - box.left) / box.width;
    const y = (event.clientY - box.top) / box.height;
    if (!(x >= 0 && x < 1 && y >= 0 && y < 1)) return null;
    const value = map.values[Math.floor(y * map.height) * map.width + Math.floor(x * map.width)];
    return { value: map.low + (value / 65535) * (map.high - map.low), x: x * size[0], y: y * size[1] };
  }
}

function drawField(context, map, message, scale, colours) {
  const values = message.array(map.arrows);
  let longest = 0;
  for (let i = 0; i < values.length; i += 4) longest = Math.max(longest, Math.hypot(values[i + 2], values[i + 3]));
  if (!longest) return "";
  const perUnit = map.unit === "mm" && map.mm_per_px ? scale / map.mm_per_px : 18 / longest;
  const times = map.unit === "mm" && map.mm_per_px ? magnification(longest * perUnit) : 1;
  const arrows = [];
  for (let i = 0; i < values.length; i += 4) {
    arrows.push([
      (values[i] + 0.5) * scale, (values[i + 1] + 0.5) * scale,
      values[i + 2] * perUnit * times, values[i + 3] * perUnit * times,
    ]);
  }
  drawArrows(context, arrows, colours.mark);
  return times > 1 ? `arrows × ${times}` : "";
}
