// Colours of maps, in OKLab: the same as in the pictures that the command line saves.

const LEVELS = 256;
const SHADES = 64;
const STRENGTH = 0.42;
const LOW = [0.47, 0.06, 268];
const HIGH = [0.93, 0.115, 90];
const MIDDLE_CHROMA = 0.012;

function srgb(lightness, a, b) {
  const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3;
  const linear = [
    4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
    -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
    -0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s,
  ];
  return linear.map((x) => {
    const v = Math.min(Math.max(x, 0), 1);
    return Math.round(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055));
  });
}

const packed = ([r, g, b]) => (255 << 24) | (b << 16) | (g << 8) | r;

function onPath(t) {
  const chroma = LOW[1] + (HIGH[1] - LOW[1]) * t + 4 * t * (1 - t) * MIDDLE_CHROMA;
  const hue = ((LOW[2] + (HIGH[2] - LOW[2]) * t) * Math.PI) / 180;
  return [LOW[0] + (HIGH[0] - LOW[0]) * t, chroma * Math.cos(hue), chroma * Math.sin(hue)];
}

function reliefTable() {
  const table = new Uint32Array(LEVELS * SHADES);
  for (let i = 0; i < LEVELS; i++) {
    const [lightness, a, b] = onPath(i / (LEVELS - 1));
    for (let j = 0; j < SHADES; j++) {
      const shade = ((2 * j) / SHADES - 1) * STRENGTH;
      const shaded = Math.min(Math.max(lightness + shade, 0.08), 0.99);
      const keep = Math.min(shaded / lightness, 1);
      table[i * SHADES + j] = packed(srgb(shaded, a * keep, b * keep));
    }
  }
  return table;
}

const RELIEF = reliefTable();
export const SEQUENTIAL = RELIEF.filter((_, index) => index % SHADES === SHADES / 2);

// Fills 32-bit pixels with a height map, coloured by its height and shaded by its slope.
export function shadeRelief(map, low, high, out) {
  const { values, width, height } = map;
  const step = (map.high - map.low) / 65535;
  const scale = (step * (LEVELS - 1)) / (high - low);
  const offset = ((map.low - low) * (LEVELS - 1)) / (high - low);
  // slopes relative to the range: a steady exaggeration that keeps faint relief visible
  const slope = ((step / (high - low)) * width) / 10;
  for (let y = 0; y < height; y++) {
    const up = Math.max(y - 1, 0) * width;
    const down = Math.min(y + 1, height - 1) * width;
    const row = y * width;
    for (let x = 0; x < width; x++) {
      const dx = (values[row + Math.min(x + 1, width - 1)] - values[row + Math.max(x - 1, 0)]) * slope;
      const dy = (values[down + x] - values[up + x]) * slope;
      const facing = (0.451 * dx + 0.551 * dy + 0.702) / Math.sqrt(1 + dx * dx + dy * dy) - 0.702;
      const level = values[row + x] * scale + offset;
      const i = level < 0 ? 0 : level > LEVELS - 1 ? LEVELS - 1 : level | 0;
      const j = Math.min(Math.max(((facing + 1) * SHADES) / 2, 0), SHADES - 1) | 0;
      out[row + x] = RELIEF[i * SHADES + j];
    }
  }
}

// Fills 32-bit pixels with the colours of a table.
export function colourMap(map, low, high, table, out) {
  const scale = (((map.high - map.low) / 65535) * (LEVELS - 1)) / (high - low);
  const offset = ((map.low - low) * (LEVELS - 1)) / (high - low);
  const { values } = map;
  for (let i = 0; i < values.length; i++) {
    const level = values[i] * scale + offset;
    out[i] = table[level < 0 ? 0 : level > LEVELS - 1 ? LEVELS - 1 : level | 0];
  }
}
