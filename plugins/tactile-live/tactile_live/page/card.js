// One sensor on the page.

import { SEQUENTIAL } from "./colours.js";
import { Connection } from "./connection.js";
import { Guided } from "./guided.js";
import { Hand } from "./hand.js";
import { MapView, RISE, Range, readMap } from "./map_view.js";
import { readMessage } from "./message.js";
import { drawOverlays, fitted, themeColours } from "./overlay.js";
import { History, Plot, shownNumber } from "./plot.js";
import { SolidView } from "./solid_view.js";
import { NumberTable, showHealth } from "./tables.js";

const WORDS_MS = 200; // time between two changes of words, so that they can be read
const SOLID_MS = 60;
const STALE_MS = 2000;
const SLIP = { none: "no contact", stick: "sticks", incipient: "slips at the border", slip: "slips", unknown: "slip not known" };

export class Card {
  constructor(number, onState) {
    const card = document.getElementById("card").content.cloneNode(true).firstElementChild;
    this.root = card;
    this.at = (selector) => card.querySelector(selector);
    this.title = this.at("h2");
    this.title.id = `sensor-${number}`;
    card.setAttribute("aria-labelledby", this.title.id);
    this.relief = new MapView(this.at(".relief"));
    this.range = new Range();
    this.solid = new SolidView(this.at(".solid"), () => this.#drawSolid());
    this.guided = new Guided(this);
    this.history = new History();
    this.plots = new Map();
    this.chosen = new Map(); // key of a number: whether the user wants its plot
    this.numbers = new NumberTable(this.at(".numbers"), (key, on) => this.chosen.set(key, on));
    this.last = null;
    this.wordsMs = this.solidMs = this.seenMs = 0;
    this.waiting = new Map();
    this.#listen();
    this.connection = new Connection(new URL(`live/${number}`, location.href.replace(/^http/, "ws")).href, {
      onText: (said) => this.#hear(said),
      onBinary: (buffer) => this.#receive(buffer),
      onState: (state) => {
        if (state === "live") this.history.clear();
        onState(state);
      },
    });
    setInterval(() => this.#lookForLife(), 1000);
  }

  // ---- what the server says

  #hear(said) {
    if (said.sensor !== undefined) this.#meet(said);
    else if (said.status === undefined) {
      const button = this.waiting.get(said.id);
      this.waiting.delete(said.id);
      if (button) button.disabled = false;
      if (said.done === "" && this.at(".said").dataset.bad === "true") this.#say("");
      const words = said.refused || said.done;
      if (words) this.#say(words, Boolean(said.refused));
    }
    if (said.status) this.#showStatus(said.status);
  }

  #meet(hello) {
    this.hello = hello;
    this.title.textContent = hello.serial ? `${hello.profile} · ${hello.serial}` : hello.profile;
    const kinds = { virtual: "Virtual sensor", recording: "Recording", live: "" };
    this.at(".about").textContent = [kinds[hello.kind], hello.description].filter(Boolean).join(". ");
    for (const button of this.root.querySelectorAll("button")) button.disabled = false;
    this.waiting.clear();
    if (hello.hand && !this.hand) this.hand = new Hand(this, this.at(".camera"), this.at(".hand"), hello);
    else this.hand?.resend();
    this.#want();
  }

  async #receive(buffer) {
    const received = performance.now();
    const message = readMessage(buffer);
    try {
      await this.#show(message, received);
    } finally {
      if (document.hidden) await new Promise((seen) => document.addEventListener("visibilitychange", seen, { once: true }));
      this.connection.send({ do: "shown", number: message.header.number });
    }
  }

  async #show(message, received) {
    const { header } = message;
    const place = header.picture;
    const picture = await createImageBitmap(new Blob([message.bytes(place)], { type: place.type }));
    this.seenMs = received;
    const size = header.size;
    const colours = (this.colours ??= themeColours());
    const samples = header.samples;
    this.history.add(samples.keys, message.array(samples.rows));
    const described = header.maps[0];
    const map = described ? readMap({ mm_per_px: header.mm_per_px, ...described }, message) : null;
    this.last = { message, header, map, size, picture };
    this.#drawCamera(colours);
    if (map) {
      this.range.follow(map, size[0] * header.mm_per_px);
      const note = this.relief.draw(map, this.range, size, { overlays: header.overlays, message, colours });
      if (received - this.solidMs > SOLID_MS) this.#drawSolid(received);
      this.mapNote = note;
    }
    this.#wordsLater();
    picture.close();
    this.shownMs = header.age_ms + performance.now() - received;
    const { dataset } = this.root;
    dataset.number = header.number;
    dataset.pictures = Number(dataset.pictures || 0) + 1;
  }

  // ---- pictures

  #drawCamera(colours) {
    const { header, message, size, picture } = this.last;
    const canvas = this.at(".camera");
    const context = fitted(canvas, size[0] / size[1]);
    if (!context) return;
    context.drawImage(picture, 0, 0, canvas.width, canvas.height);
    const scale = canvas.width / size[0];
    this.cameraNote = drawOverlays(context, header.overlays, message, scale, colours);
    this.hand?.draw(context, scale, colours);
    this.guided.draw(context, scale, colours);
  }

  #drawSolid(now = performance.now()) {
    if (!this.last?.map || !this.relief.pixels) return;
    this.solidMs = now;
    this.solid.draw(this.last.map, this.range, this.relief.pixels, this.last.size);
  }

  // ---- words and numbers

  // Changes the words now, or as soon as the last ones could be read.
  #wordsLater() {
    if (this.wordsDue) return;
    const change = () => {
      this.wordsDue = 0;
      this.wordsMs = performance.now();
      this.#showWords(this.last.header, this.last.map, (this.colours ??= themeColours()));
    };
    const waitMs = this.wordsMs + WORDS_MS - performance.now();
    if (waitMs <= 0) change();
    else this.wordsDue = setTimeout(change, waitMs);
  }

  #showWords(header, map, colours) {
    const entries = header.entries;
    const value = new Map(entries.map(([key, , , one]) => [key, one]));
    const slip = value.get("slip.state");
    const area = value.get("contact_area_mm2");
    const state = slip ?? (area === undefined ? "unknown" : area ? "stick" : "none");
    const dd = this.at(".slip");
    dd.dataset.slip = slip ? state : "none";
    const degree = value.get("slip.degree");
    dd.textContent = slip ? SLIP[slip] + (degree && slip !== "none" ? ` ${Math.round(100 * degree)} %` : "") : area === undefined ? "not measured" : area ? "in contact" : "no contact";
    this.at(".rate").textContent = `${header.rate_hz.toFixed(1)} Hz`;
    this.at(".latency").textContent = `${header.latency_ms.toFixed(1)} ms`;
    this.at(".shown").textContent = this.shownMs ? `${this.shownMs.toFixed(0)} ms` : "–";
    const verdict = header.health.verdict ?? "unknown";
    const health = this.at(".verdict");
    health.dataset.verdict = verdict;
    health.textContent = { ok: "well", warning: "look at it", unknown: "not known" }[verdict];
    if (this.at(".health").open) showHealth(this.at(".findings"), header.health);
    this.#showMaps(header, map);
    this.#showPlots(header, colours);
    if (this.at(".all").open) this.numbers.show(entries, new Set(this.plots.keys()));
    this.#showWarnings(header);
    this.at(".source").textContent = `${header.source}, ${header.time_s.toFixed(2)} s`;
    const relative = header.relative ? "relative to the first frame" : "";
    this.at(".picture-note").textContent = [this.cameraNote, relative].filter(Boolean).join(" · ");
  }

  #showMaps(header, map) {
    const select = this.at(".map");
    const keys = header.maps_there.map((one) => one.key).join("\n");
    if (this.mapKeys !== keys) {
      this.mapKeys = keys;
      const kept = select.value;
      select.replaceChildren(...header.maps_there.map((one) => new Option(one.title, one.key)));
      if (header.maps_there.some((one) => one.key === kept)) select.value = kept;
    }
    const channels = this.at(".channel");
    if (channels.options.length !== header.channels.length + 1) {
      channels.replaceChildren(new Option("all", ""), ...header.channels.map((name, index) => new Option(name, index)));
    }
    if (!map) {
      this.at(".solid-note").textContent = "Nothing is measured as a map yet: calibrate, or take a reference.";
      return;
    }
    const { low, high } = this.range;
    this.at(".low").textContent = shownNumber(low, map.unit);
    this.at(".high").textContent = shownNumber(high, map.unit);
    const rise = map.kind === "surface" ? RISE * header.size[0] * header.mm_per_px / (high - low) : 0;
    this.at(".solid-note").textContent = rise ? `heights × ${rise.toFixed(rise < 10 ? 1 : 0)}` : "";
    this.relief.canvas.setAttribute("aria-label", `Map of ${map.title}, from ${shownNumber(map.low, map.unit)} to ${shownNumber(map.high, map.unit)}`);
    this.#drawColours(map);
  }

  #drawColours() {
    if (this.coloured) return;
    this.coloured = true;
    const context = this.at(".colours").getContext("2d");
    SEQUENTIAL.forEach((colour, index) => {
      context.fillStyle = `rgb(${colour & 255} ${(colour >> 8) & 255} ${(colour >> 16) & 255})`;
      context.fillRect((index * 160) / 256, 0, 1.5, 8);
    });
  }

  #showPlots(header, colours) {
    const wanted = new Map();
    for (const [key, title, unit, value] of header.entries) {
      const on = this.chosen.get(key) ?? header.featured.includes(key);
      if (on && (typeof value === "number" || this.plots.has(key))) wanted.set(key, [title, unit]);
    }
    for (const [key, plot] of this.plots) {
      if (wanted.has(key)) continue;
      plot.element.remove();
      this.plots.delete(key);
    }
    for (const [key, [title, unit]] of wanted) {
      let plot = this.plots.get(key);
      if (!plot) {
        this.plots.set(key, (plot = new Plot(title, unit)));
        this.at(".plots").append(plot.element);
      }
      plot.draw(this.history.series.get(key), this.history.newest, colours);
    }
  }

  #showWarnings(header) {
    const bad = [header.failure, this.status?.problem].filter(Boolean);
    const words = [...bad, ...header.warnings];
    const text = words.join("\n");
    const now = performance.now();
    if (text) this.warnedMs = now;
    // a warning of a single frame stays long enough to be read
    if (this.warned === text || (!text && now - this.warnedMs < 5000)) return;
    this.warned = text;
    this.at(".warnings").replaceChildren(
      ...[...new Set(words)].map((sentence) => {
        const item = document.createElement("li");
        item.textContent = sentence;
        item.dataset.bad = bad.includes(sentence);
        return item;
      }),
    );
  }

  #showStatus(status) {
    this.status = status;
    const { playback, recording } = status;
    const bar = this.at(".playback");
    bar.hidden = !playback;
    if (playback) {
      const pause = this.at('[data-do="pause"]');
      const halted = playback.paused || playback.ended;
      pause.textContent = halted ? "Play" : "Pause";
      pause.setAttribute("aria-pressed", String(halted));
      if (document.activeElement !== this.at(".speed")) this.at(".speed").value = String(playback.speed);
      this.at(".loop").checked = playback.loop;
    }
    this.at('[data-do="calibration"]').hidden = this.hello?.kind === "recording";
    this.guided.show(status, this.hello?.number ?? 0, (this.colours ??= themeColours()));
    const record = this.at('[data-do="record"]');
    record.setAttribute("aria-pressed", String(Boolean(recording)));
    record.querySelector(".label").textContent = recording
      ? `Stop, ${recording.images} images${recording.dropped ? `, ${recording.dropped} dropped` : ""}` : "Record";
    if (recording?.failure) this.#say(recording.failure, true);
  }

  #say(words, bad = false) {
    const place = this.at(".said");
    place.textContent = words;
    place.dataset.bad = bad;
  }

  #lookForLife() {
    const silent = this.seenMs && performance.now() - this.seenMs > STALE_MS && !document.hidden;
    const { playback } = this.status ?? {};
    const playing = !playback || !(playback.paused || playback.ended);
    if (silent && playing && !this.silent) this.#say("No picture has come for two seconds; is the camera plugged in?", true);
    else if (!silent && this.silent) this.#say("");
    this.silent = silent && playing;
  }

  // ---- what the user does

  #listen() {
    const words = {
      begin: () => ({ do: "calibrate", on: true, ...this.guided.ball }),
      leave: () => ({ do: "calibrate", on: false }),
      pause: () => ({ do: "play", paused: this.at('[data-do="pause"]').getAttribute("aria-pressed") !== "true" }),
      step: () => ({ do: "play", step: true }),
      record: () => ({ do: "record", on: this.at('[data-do="record"]').getAttribute("aria-pressed") !== "true" }),
    };
    this.root.addEventListener("click", (event) => {
      const button = event.target.closest("button[data-do]");
      if (!button) return;
      const name = button.dataset.do;
      if (name === "upright") {
        this.solid.reset();
        this.#drawSolid();
      } else if (name === "calibration") this.guided.open();
      else this.#ask(words[name]?.() ?? { do: name }, button);
    });
    this.at(".speed").addEventListener("change", (event) => this.#ask({ do: "play", speed: Number(event.target.value) }));
    this.at(".loop").addEventListener("change", (event) => this.#ask({ do: "play", loop: event.target.checked }));
    for (const name of [".map", ".channel"]) this.at(name).addEventListener("change", () => this.#want());
    this.relief.canvas.addEventListener("pointermove", (event) => this.#probe(event));
    this.relief.canvas.addEventListener("pointerleave", () => (this.at(".probe").textContent = ""));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => (this.colours = null));
  }

  #ask(command, button) {
    const id = (this.asked = (this.asked || 0) + 1);
    if (!this.connection.send({ id, ...command })) {
      this.#say("The server does not answer; it is looked for.", true);
      return;
    }
    if (!button) return;
    button.disabled = true;
    this.waiting.set(id, button);
  }

  #want() {
    const map = this.at(".map").value;
    const channel = this.at(".channel").value;
    this.#ask({ do: "want", maps: map ? [map] : [], channel: channel === "" ? null : Number(channel), ...this.pace });
  }

  limit(picturesPerS) {
    this.pace = { pictures_per_s: picturesPerS };
    this.#want();
  }

  #probe(event) {
    if (!this.last?.map) return;
    const found = this.relief.probe(event, this.last.map, this.last.size);
    this.at(".probe").textContent = found ? `${shownNumber(found.value, this.last.map.unit)} at ${found.x.toFixed(0)}, ${found.y.toFixed(0)}` : "";
  }
}
