"use strict";
// Filter, view and zoom of the whole page; the swipe of each pair. Without this script all pairs stand side by side.

const ORDER = ["failed", "differs", "equal"]; // a filter shows its kind and the worse ones
const pairs = [...document.querySelectorAll(".pair")];
const search = document.getElementById("search");
const zoom = document.getElementById("zoom");
const filters = [...document.querySelectorAll("[data-filter]")];
const views = [...document.querySelectorAll("button[data-view]")];

function press(buttons, pressed) {
  for (const button of buttons) button.setAttribute("aria-pressed", String(button === pressed));
}

function filter() {
  const least = ORDER.indexOf(filters.find((button) => button.getAttribute("aria-pressed") === "true").dataset.filter);
  const word = search.value.toLowerCase();
  for (const pair of pairs) pair.hidden = ORDER.indexOf(pair.dataset.kind) > least || !pair.dataset.name.includes(word);
  document.getElementById("nothing").hidden = pairs.some((pair) => !pair.hidden);
}

function look(view) {
  document.body.dataset.view = view;
  press(views, views.find((button) => button.dataset.view === view));
}

function enlarge(on) {
  zoom.setAttribute("aria-pressed", String(on));
  document.body.classList.toggle("zoomed", on);
  for (const image of document.querySelectorAll(".stage img")) image.style.width = on ? `${3 * image.naturalWidth}px` : "";
}

function go(step) {
  const shown = pairs.filter((pair) => !pair.hidden);
  if (!shown.length) return;
  const at = shown.indexOf(document.activeElement.closest(".pair"));
  const next = shown[at < 0 ? (step > 0 ? 0 : shown.length - 1) : Math.min(Math.max(at + step, 0), shown.length - 1)];
  next.focus({ preventScroll: true });
  next.scrollIntoView();
}

for (const button of filters) button.addEventListener("click", () => { press(filters, button); filter(); });
for (const button of views) button.addEventListener("click", () => look(button.dataset.view));
search.addEventListener("input", filter);
zoom.addEventListener("click", () => enlarge(zoom.getAttribute("aria-pressed") !== "true"));

for (const shown of document.querySelectorAll(".shown")) {
  const [stage, range] = [shown.querySelector(".stage"), shown.querySelector("input[type=range]")];
  if (!range) continue;
  const swipe = () => stage.style.setProperty("--at", `${range.value}%`);
  const drag = (event) => {
    if (document.body.dataset.view !== "swipe" || !(event.buttons & 1)) return;
    const box = stage.querySelector(".new img").getBoundingClientRect();
    range.value = Math.min(Math.max((100 * (event.clientX - box.left)) / box.width, 0), 100);
    swipe();
  };
  range.addEventListener("input", swipe);
  stage.addEventListener("pointerdown", drag);
  stage.addEventListener("pointermove", drag);
}

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.target === search) return;
  const pair = document.activeElement.closest(".pair");
  const range = pair && pair.querySelector("input[type=range]");
  if (event.key === "j" || event.key === "k") go(event.key === "j" ? 1 : -1);
  else if ("1234".includes(event.key)) look(views[Number(event.key) - 1].dataset.view);
  else if (event.key === "z") zoom.click();
  else if (event.key === "f") {
    filters[(filters.findIndex((button) => button.getAttribute("aria-pressed") === "true") + 1) % filters.length].click();
  } else if (range && document.activeElement !== range && (event.key === "ArrowLeft" || event.key === "ArrowRight")) {
    range.value = Number(range.value) + (event.key === "ArrowRight" ? 5 : -5);
    range.dispatchEvent(new Event("input"));
    event.preventDefault();
  }
});

look("side");
filter();
