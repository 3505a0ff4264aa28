// Puts a card for each sensor on the page.

import { Card } from "./card.js";

const WORDS = { connecting: "Connecting", live: "Connected", lost: "The server does not answer; looking for it" };

const place = document.getElementById("sensors");
const note = document.getElementById("connection");
const states = [];

function show() {
  const state = states.includes("lost") ? "lost" : states.every((one) => one === "live") ? "live" : "connecting";
  if (note.dataset.state === state) return;
  note.dataset.state = state;
  note.textContent = WORDS[state];
}

const sensors = await (await fetch("sensors.json")).json();
place.classList.toggle("several", sensors.length > 1);
const cards = [];
// for whoever needs fewer pictures, such as over a slow network: tactile.limit(5) in the console
globalThis.tactile = { limit: (picturesPerS) => cards.forEach((card) => card.limit(picturesPerS)) };
sensors.forEach((_, index) => {
  states.push("connecting");
  const card = new Card(index, (state) => {
    states[index] = state;
    show();
  });
  cards.push(card);
  place.append(card.root);
});
