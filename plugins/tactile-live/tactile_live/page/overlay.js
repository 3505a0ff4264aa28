// Outlines, points and arrows over a picture or a map.

const ARROW_PX = 26; // length on the screen of the longest arrow
const LONGEST = 12; // magnification beyond which arrows of nothing would look like motion

export function themeColours() {
  const style = getComputedStyle(document.documentElement);
  const of = (name) => style.getPropertyValue(name).trim();
  return {
    ink: of("--ink"), soft: of("--soft"), line: of("--line"), accent: of("--accent"),
    mark: of("--mark"), contact: of("--contact"), care: of("--care"), bad: of("--bad"), sunk: of("--sunk"),
  };
}

// Fits a canvas to its place on the page; returns its context, or null while it is hidden.
export function fitted(canvas, aspect) {
  const width = Math.round(canvas.clientWidth * Math.min(devicePixelRatio, 2));
  if (!width) return null;
  const height = Math.round(width / aspect);
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
  }
  return canvas.getContext("2d");
}

export function drawOverlays(context, overlays, message, scale, colours) {
  let note = "";
  let outlines = 0;
  for (const overlay of overlays) {
    if (overlay.kind === "outline") drawOutline(context, overlay, message, scale, outlines++ > 0);
    else note = drawPoints(context, overlay, message, scale, colours) || note;
  }
  return note;
}

function drawOutline(context, overlay, message, scale, further) {
  context.beginPath();
  for (const line of overlay.lines) {
    const places = message.array(line);
    for (let i = 0; i < places.length; i += 2) {
      const x = (places[i] + 0.5) * scale;
      const y = (places[i + 1] + 0.5) * scale;
      if (i) context.lineTo(x, y);
      else context.moveTo(x, y);
    }
    context.closePath();
  }
  // dark and light together are visible on every picture
  context.lineJoin = "round";
  context.setLineDash(further ? [2, 5] : []);
  context.lineWidth = 3.5;
  context.strokeStyle = "rgb(0 0 0 / 45%)";
  context.stroke();
  context.lineWidth = 1.6;
  context.strokeStyle = "#7ff0e4";
  context.stroke();
  context.setLineDash([]);
}

function drawPoints(context, overlay, message, scale, colours) {
  const places = message.array(overlay.places);
  const reliable = message.array(overlay.reliable);
  let longest = 0;
  for (let i = 0; i < places.length; i += 4) {
    longest = Math.max(longest, Math.hypot(places[i] - places[i + 2], places[i + 1] - places[i + 3]));
  }
  const times = overlay.moved ? magnification(longest * scale) : 1;
  for (const seen of [1, 0]) {
    context.beginPath();
    for (let i = 0; i < places.length; i += 4) {
      if (reliable[i / 4] !== seen) continue;
      const x = (places[i] + 0.5) * scale;
      const y = (places[i + 1] + 0.5) * scale;
      const radius = seen ? 1.7 : 2.6;
      context.moveTo(x + radius, y);
      context.arc(x, y, radius, 0, 2 * Math.PI);
    }
    context.fillStyle = context.strokeStyle = "rgb(255 255 255 / 85%)";
    context.lineWidth = 1;
    if (seen) context.fill();
    else context.stroke();
  }
  if (overlay.moved && longest * scale > 0.2) {
    const arrows = [];
    for (let i = 0; i < places.length; i += 4) {
      const dx = (places[i] - places[i + 2]) * scale * times;
      const dy = (places[i + 1] - places[i + 3]) * scale * times;
      if (reliable[i / 4]) arrows.push([(places[i + 2] + 0.5) * scale, (places[i + 3] + 0.5) * scale, dx, dy]);
    }
    drawArrows(context, arrows, colours.mark);
  }
  const count = reliable.reduce((sum, one) => sum + one, 0);
  const words = `${count} of ${reliable.length} ${overlay.title || "points"}`;
  return overlay.moved ? `${words}, arrows × ${times}` : words;
}

export function magnification(longestPx) {
  const wanted = Math.min(ARROW_PX / Math.max(longestPx, 1e-6), LONGEST);
  return [1, 2, 5, 10].reduce((best, one) => (one <= wanted ? one : best), 1);
}

export function drawArrows(context, arrows, colour) {
  context.beginPath();
  for (const [x, y, dx, dy] of arrows) {
    const length = Math.hypot(dx, dy);
    if (length < 1.5) continue;
    const head = Math.min(5, 0.4 * length) / length;
    context.moveTo(x, y);
    context.lineTo(x + dx, y + dy);
    context.lineTo(x + dx - head * (dx + 0.6 * dy), y + dy - head * (dy - 0.6 * dx));
    context.moveTo(x + dx, y + dy);
    context.lineTo(x + dx - head * (dx - 0.6 * dy), y + dy - head * (dy + 0.6 * dx));
  }
  context.lineCap = "round";
  context.lineWidth = 3;
  context.strokeStyle = "rgb(0 0 0 / 40%)";
  context.stroke();
  context.lineWidth = 1.6;
  context.strokeStyle = colour;
  context.stroke();
}
