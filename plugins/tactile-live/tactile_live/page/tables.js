// The tables of all numbers and of the health.

import { shownNumber } from "./plot.js";

const WORDS = { ok: "well", warning: "look at it", unknown: "not known" };

export class NumberTable {
  constructor(table, onPlot) {
    this.body = table.tBodies[0];
    this.onPlot = onPlot;
    this.rows = new Map();
  }

  show(entries, plotted) {
    const there = new Set();
    for (const [key, title, unit, value] of entries) {
      there.add(key);
      const row = this.rows.get(key) || this.#row(key, title);
      row.value.textContent = shownNumber(value, unit);
      row.plot.hidden = typeof value !== "number";
      row.plot.checked = plotted.has(key);
    }
    for (const [key, row] of this.rows) {
      if (there.has(key)) continue;
      row.element.remove();
      this.rows.delete(key);
    }
  }

  #row(key, title) {
    const element = this.body.insertRow();
    const name = document.createElement("th");
    name.scope = "row";
    name.textContent = title;
    element.append(name);
    const value = element.insertCell();
    value.className = "value";
    const plot = document.createElement("input");
    plot.type = "checkbox";
    plot.setAttribute("aria-label", `Plot ${title}`);
    plot.addEventListener("change", () => this.onPlot(key, plot.checked));
    element.insertCell().append(plot);
    const row = { element, value, plot };
    this.rows.set(key, row);
    return row;
  }
}

export function showHealth(table, health) {
  const rows = Object.entries(health).filter(([, found]) => found && typeof found === "object");
  const body = document.createElement("tbody");
  for (const [name, found] of rows) {
    const row = body.insertRow();
    const head = document.createElement("th");
    head.scope = "row";
    head.textContent = name.replaceAll("_", " ");
    row.append(head);
    for (const value of [found.value, found.expected]) {
      const cell = row.insertCell();
      cell.className = "value";
      cell.textContent = shownNumber(value, found.unit);
    }
    row.insertCell().textContent = found.message || WORDS[found.verdict];
  }
  table.tBodies[0].replaceWith(body);
}
