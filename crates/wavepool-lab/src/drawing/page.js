// Moves a mark over the picture and looks up what it covers.
"use strict";
{
  const { lanes, charts } = JSON.parse(document.getElementById("charts").textContent);
  const element = (id) => document.getElementById(id);
  const svg = document.querySelector("#picture svg");
  const steps = Math.max(1, ...charts.map((chart) => chart.rows.length));
  const shape = (attributes) => {
    const rect = document.createElementNS("http://www.w3.org/2000/svg", "rect");
    for (const [name, value] of Object.entries(attributes)) rect.setAttribute(name, value);
    return svg.appendChild(rect);
  };
  const percent = (part, all) => (all > 0 ? (part / all * 100).toFixed(0) : "0") + " %";
  let now = 0;
  let timer = null;

  for (const chart of charts) {
    chart.width = Math.ceil(chart.blocks / chart.each[0]) * chart.cell[0];
    chart.height = Math.ceil(chart.rows.length / chart.each[1]) * chart.cell[1];
    chart.cover = shape({ x: chart.x, width: chart.width, fill: "#fff", opacity: 0.85, "pointer-events": "none" });
    chart.mark = shape({ x: chart.x - 3, width: chart.width + 6, fill: "none", stroke: "#000", "stroke-width": 2.5, "pointer-events": "none" });
    chart.inner = shape({ x: chart.x - 3, width: chart.width + 6, fill: "none", stroke: "#ff0", "stroke-width": 1, "pointer-events": "none" });
    if (chart.shares) chart.bytes = Uint8Array.from(atob(chart.shares), (c) => c.charCodeAt(0));
    if (chart.spans) {
      chart.of_block = Array.from({ length: chart.blocks }, () => []);
      for (const span of chart.spans) chart.of_block[span[0]].push(span);
    }
    chart.card = element("cards").appendChild(document.createElement("div"));
    chart.card.className = "card";
    chart.card.appendChild(document.createElement("b")).textContent = chart.title;
    chart.lines = [0, 1, 2].map(() => chart.card.appendChild(document.createElement("div")));
    let sum = 1;
    chart.launched = chart.rows.map((row) => sum += row[3]);
  }

  const describe = (chart) => {
    const row = chart.rows[now];
    if (!row) return [`done after ${chart.rows.length} steps`, "", ""];
    const [blocks, alive, begun, launches] = row;
    const first = `step ${now + 1} of ${chart.rows.length}: ${blocks} of ${chart.blocks} blocks live, ${begun} begin a tile; `
      + `${alive} lanes alive (${percent(alive, blocks * lanes)} of theirs); ${launches} launches, ${chart.launched[now]} so far`;
    const words = chart.words ? chart.words[now] : null;
    return [first, words && words[1] ? words[1] : "", words && words[0] ? "queue: " + words[0] : ""];
  };

  const show = (step) => {
    now = Math.min(Math.max(step, 0), steps - 1);
    element("step").value = now + 1;
    element("now").textContent = `step ${now + 1} of ${steps}`;
    for (const chart of charts) {
      const top = chart.y + Math.min(Math.floor(now / chart.each[1]) * chart.cell[1], chart.height);
      const is_over = now >= chart.rows.length;
      for (const mark of [chart.mark, chart.inner]) {
        mark.setAttribute("y", top - 1);
        mark.setAttribute("height", chart.cell[1] + 2);
        mark.setAttribute("visibility", is_over ? "hidden" : "visible");
      }
      const below = Math.min(top + chart.cell[1] + 2, chart.y + chart.height);
      chart.cover.setAttribute("y", below);
      chart.cover.setAttribute("height", element("cover").checked ? chart.y + chart.height - below : 0);
      describe(chart).forEach((line, place) => chart.lines[place].textContent = line);
    }
  };

  const pause = () => {
    clearInterval(timer);
    timer = null;
    element("play").textContent = "play";
  };
  const play = () => {
    if (timer !== null) return pause();
    if (now === steps - 1) show(0);
    element("play").textContent = "pause";
    const speed = Number(element("speed").value);
    const stride = Math.max(1, Math.round(speed / 60));
    timer = setInterval(() => {
      show(now + stride);
      if (now === steps - 1) pause();
    }, 1000 * stride / speed);
  };

  element("step").max = steps;
  element("step").addEventListener("input", (event) => show(Number(event.target.value) - 1));
  element("cover").addEventListener("change", () => show(now));
  element("speed").addEventListener("change", () => { if (timer !== null) { pause(); play(); } });
  const actions = { first: () => show(0), back: () => show(now - 1), next: () => show(now + 1), last: () => show(steps - 1), play };
  for (const [id, action] of Object.entries(actions)) element(id).addEventListener("click", action);
  const keys = { ArrowLeft: "back", ArrowRight: "next", Home: "first", End: "last", " ": "play" };
  document.addEventListener("keydown", (event) => {
    const action = keys[event.key];
    if (!action || event.ctrlKey || event.altKey || event.metaKey || event.target.tagName === "SELECT") return;
    event.preventDefault();
    actions[action]();
  });

  const found = (chart, x, y) => {
    const column = Math.floor((x - chart.x) / chart.cell[0]);
    const row = Math.floor((y - chart.y) / chart.cell[1]);
    const [block, step] = [column * chart.each[0], row * chart.each[1]];
    if (column < 0 || row < 0 || block >= chart.blocks || step >= chart.rows.length) return null;
    const to = (first, each, all) => each === 1 ? `${first}` : `${first}\u2013${Math.min(first + each, all) - 1}`;
    const place = `block ${to(block, chart.each[0], chart.blocks)}, step ${to(step + 1, chart.each[1], chart.rows.length + 1)}`;
    if (chart.of_block && chart.each[0] === 1 && chart.each[1] === 1) {
      const span = chart.of_block[block].find((span) => span[1] <= step && step < span[1] + span[3].length);
      if (!span) return `${place}\ndead`;
      const begins = span[1] === step ? "begins" : `since step ${span[1] + 1}`;
      const alive = span[3][step - span[1]];
      return `${place}\ntile ${span[2]}, ${begins}, ${span[3].length} steps in all\n${alive} of ${lanes} lanes alive`;
    }
    if (chart.bytes) {
      const share = chart.bytes[row * chart.columns + column];
      return `${place}\n` + (share === 255 ? "no block lives" : `${percent(share, 254)} of the lanes alive`);
    }
    return place;
  };
  svg.addEventListener("mousemove", (event) => {
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    const words = charts.map((chart) => found(chart, point.x, point.y)).find((words) => words);
    const tip = element("tip");
    tip.style.display = words ? "block" : "none";
    if (!words) return;
    tip.textContent = words;
    tip.style.left = Math.min(event.clientX + 14, innerWidth - 330) + "px";
    tip.style.top = Math.min(event.clientY + 14, innerHeight - 70) + "px";
  });
  svg.addEventListener("mouseleave", () => element("tip").style.display = "none");
  show(0);
}
