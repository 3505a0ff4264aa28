// Guided calibration: where to press next, what is covered, and how good it is already.

import { shownNumber } from "./plot.js";

const READY = "Measure the ball, take your hands off the gel, and begin: a reference is taken first.";

export class Guided {
  constructor(card) {
    this.at = card.at;
    this.toggle = this.at('[data-do="calibration"]');
    this.panel = this.at(".guided");
    this.guidance = null;
  }

  open(on = this.panel.hidden) {
    this.panel.hidden = !on;
    this.toggle.setAttribute("aria-expanded", String(on));
    this.toggle.setAttribute("aria-pressed", String(on));
  }

  get ball() {
    return { ball_diameter_mm: Number(this.at(".ball").value) || null, measured_with: this.at(".measured-with").value };
  }

  show(status, number, colours) {
    const { calibration, guidance } = status;
    this.guidance = guidance;
    if (calibration && this.panel.hidden) this.open(true);
    this.at('[data-do="begin"]').disabled = Boolean(calibration);
    this.at('[data-do="leave"]').disabled = calibration !== "pressing";
    this.at('[data-do="finish"]').disabled = calibration !== "pressing" || !guidance?.kept;
    const report = this.at(".report");
    report.hidden = !status.report;
    report.href = `report/${number}`;
    const say = this.at(".say");
    const words = calibration === "fitting" ? "Fitting; this takes some seconds." : calibration === "beginning" ? "Keep your hands off the gel: a reference is taken." : guidance ? guidance.say : calibration ? "Looking at the gel." : READY;
    if (say.textContent !== words) say.textContent = words;
    say.dataset.state = guidance?.state ?? "";
    this.at(".guided-state").hidden = !guidance;
    if (!guidance) return;
    this.at(".kept").textContent = guidance.examining ? `${guidance.kept} …` : String(guidance.kept);
    this.at(".held-out").textContent = shownNumber(guidance.held_out, "°");
    this.at(".covered").textContent = `${Math.round(100 * guidance.coverage)} %`;
    cells(this.at(".coverage"), guidance.coverage_map, colours);
    cells(this.at(".slopes"), guidance.slope_map, colours);
    bars(this.at(".scores"), guidance.held_out_each, colours);
  }

  // Draws the ring to fill, and the circle that was found last, over the camera's picture.
  draw(context, scale, colours) {
    const { guidance } = this;
    if (!guidance) return;
    if (guidance.circle) {
      context.strokeStyle = guidance.refused ? colours.bad : "rgb(255 255 255 / 80%)";
      context.lineWidth = 1.5;
      ring(context, guidance.circle.centre_px, guidance.circle.contact_radius_px, scale);
    }
    if (!guidance.target_px) return;
    context.lineWidth = 6;
    context.strokeStyle = "rgb(0 0 0 / 45%)";
    ring(context, guidance.target_px, guidance.target_radius_px, scale);
    context.lineWidth = 3;
    context.setLineDash([7, 6]);
    context.strokeStyle = "#ffd166";
    ring(context, guidance.target_px, guidance.target_radius_px, scale);
    context.setLineDash([]);
  }
}

function ring(context, [x, y], radius, scale) {
  context.beginPath();
  context.arc((x + 0.5) * scale, (y + 0.5) * scale, radius * scale, 0, 2 * Math.PI);
  context.stroke();
}

function sized(canvas) {
  const ratio = Math.min(devicePixelRatio, 2);
  canvas.width = canvas.clientWidth * ratio;
  canvas.height = canvas.clientHeight * ratio;
  return canvas.getContext("2d");
}

function cells(canvas, rows, colours) {
  const context = sized(canvas);
  const high = canvas.height / rows.length;
  rows.forEach((row, i) => {
    const wide = canvas.width / row.length;
    row.forEach((value, j) => {
      context.globalAlpha = 0.08 + 0.92 * Math.min(value, 1);
      context.fillStyle = colours.accent;
      const gap = Math.min(wide, high) > 8 ? 0.5 : 0;
      context.fillRect(j * wide + gap, i * high + gap, wide - 2 * gap, high - 2 * gap);
    });
  });
  context.globalAlpha = 1;
}

function bars(canvas, values, colours) {
  const context = sized(canvas);
  if (!values.length) return;
  const most = Math.max(...values);
  const wide = canvas.width / Math.max(values.length, 12);
  context.fillStyle = colours.accent;
  values.forEach((value, index) => {
    const high = (0.92 * canvas.height * value) / most;
    context.fillRect(index * wide + 1, canvas.height - high, Math.max(wide - 2, 1), high);
  });
}
