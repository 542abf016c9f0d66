"use strict";

const data = JSON.parse(document.getElementById("data").textContent);
const one = (selector, within = document) => within.querySelector(selector);
const all = (selector, within = document) => [...within.querySelectorAll(selector)];
const make = (name, text = "", className = "") => {
  const element = document.createElement(name);
  element.textContent = text;
  element.className = className;
  return element;
};
const svg = (name, attributes) => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  return element;
};
const compare = (a, b) =>
  typeof a === "string" ? a.localeCompare(b, undefined, { numeric: true }) : a - b;
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
/* Text whose direction, and whatever it does to that, ends with it: as <bdi> does. */
const isolated = (text) => `\u2068${text}\u2069`;
const plural = (number, word) => `${number} ${word}${number === 1 ? "" : "s"}`;

function say(text) {
  const toast = one(".toast");
  toast.textContent = text;
  clearTimeout(say.timer);
  say.timer = setTimeout(() => (toast.textContent = ""), 5000);
}
