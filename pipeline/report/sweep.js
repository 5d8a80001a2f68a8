"use strict";
// One clock for all films, a table that sorts itself and the films. Without this script each film shows its frames as a sheet.

const films = [...document.querySelectorAll(".film")].map((link) => ({
  link,
  image: link.querySelector("img"),
  times: JSON.parse(link.dataset.times),
  files: JSON.parse(link.dataset.files),
  columns: Number(link.dataset.columns),
  rows: Number(link.dataset.rows),
}));
const [time, clock, play, size] = ["time", "clock", "play", "size"].map((id) => document.getElementById(id));
const marks = [...new Set(films.flatMap((film) => film.times))].sort((a, b) => a - b);
const cards = [...document.querySelectorAll(".films .card")];
const table = document.getElementById("figures");
const rows = [...table.tBodies[0].rows];

function show() {
  const now = Number(time.value);
  clock.textContent = `${now.toFixed(2)} s`;
  for (const { link, image, times, files, columns } of films) {
    let at = 0;
    while (at + 1 < times.length && times[at + 1] <= now + 1e-6) at += 1;
    image.style.left = `${-100 * (at % columns)}%`;
    image.style.top = `${-100 * Math.floor(at / columns)}%`;
    link.href = files[at];
    link.dataset.at = at;
  }
}

function step(direction) {
  const now = Number(time.value);
  const next = direction > 0 ? marks.find((mark) => mark > now + 1e-6) : marks.findLast((mark) => mark < now - 1e-6);
  if (next !== undefined) time.value = next;
  show();
}

let started = null;
function run(stamp) {
  if (play.getAttribute("aria-pressed") !== "true") return;
  if (started === null) started = stamp - 1000 * Number(time.value);
  const length = Number(time.max) + 0.3; // the last frame is held
  const now = ((stamp - started) / 1000) % length;
  time.value = Math.min(now, Number(time.max));
  show();
  requestAnimationFrame(run);
}

function toggle() {
  play.setAttribute("aria-pressed", String(play.getAttribute("aria-pressed") !== "true"));
  started = null;
  requestAnimationFrame(run);
}

function values(column) {
  return rows.map((row) => row.cells[column].querySelector("[data-value]").dataset.value);
}

function sort(column) {
  const head = table.tHead.rows[0].cells[column];
  const down = head.getAttribute("aria-sort") === "ascending";
  for (const cell of table.tHead.rows[0].cells) cell.removeAttribute("aria-sort");
  head.setAttribute("aria-sort", down ? "descending" : "ascending");
  const found = new Map(rows.map((row, index) => [row, values(column)[index]]));
  const numbers = [...found.values()].every((value) => value === "" || Number.isFinite(Number(value)));
  const compare = (a, b) => (numbers ? Number(a) - Number(b) : a.localeCompare(b, "en", { numeric: true }));
  const sorted = [...rows].sort((a, b) => {
    const [x, y] = [found.get(a), found.get(b)];
    if ((x === "") !== (y === "")) return x === "" ? 1 : -1; // what is not there comes last
    return (down ? -1 : 1) * compare(x, y);
  });
  for (const row of sorted) {
    table.tBodies[0].append(row);
    const card = cards[Number(row.querySelector("[data-run]").dataset.run)];
    card.parentElement.append(card);
  }
}

for (const { link, image, columns, rows: count } of films) {
  link.style.aspectRatio = link.dataset.shape;
  image.style.width = `${100 * columns}%`;
  image.style.height = `${100 * count}%`;
}
time.max = marks.at(-1) ?? 0;
time.addEventListener("input", () => { started = null; show(); });
play.addEventListener("click", toggle);
size.addEventListener("input", () => document.documentElement.style.setProperty("--size", `${size.value}px`));
[...table.tHead.rows[0].cells].forEach((cell, column) => cell.querySelector("button").addEventListener("click", () => sort(column)));

for (let column = 0; column < table.tHead.rows[0].cells.length; column += 1) {
  if (!table.tHead.rows[0].cells[column].classList.contains("number")) continue;
  const found = values(column).map((value) => Math.abs(Number(value)));
  const most = Math.max(...found) || 1;
  if (Math.min(...found) === most) continue; // a bar that is the same everywhere tells nothing
  rows.forEach((row, index) => row.cells[column].style.setProperty("--part", `${(100 * found[index]) / most}%`));
}
for (const row of rows) {
  const card = cards[Number(row.querySelector("[data-run]").dataset.run)];
  row.addEventListener("pointerenter", () => card.classList.add("at"));
  row.addEventListener("pointerleave", () => card.classList.remove("at"));
}
document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.target === size) return;
  if (event.key === " " && event.target.tagName !== "BUTTON") toggle();
  else if (event.key === "ArrowRight") step(1);
  else if (event.key === "ArrowLeft") step(-1);
  else return;
  event.preventDefault();
});
show();
