"use strict";
(() => {
  const root = document.documentElement;
  root.classList.add("scripted");
  addEventListener("load", () => setTimeout(() => root.classList.remove("loading"), 0));

  const button = document.getElementById("theme");
  button.hidden = false;
  button.addEventListener("click", () => {
    const system = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
    root.dataset.theme = (root.dataset.theme || system) === "dark" ? "light" : "dark";
  });

  for (const choice of document.querySelectorAll(".choice")) {
    const chooser = choice.querySelector(":scope > .chooser");
    const options = choice.querySelectorAll(":scope > .option");
    const select = chooser.querySelector("select");
    const show = () => options.forEach((option, k) => { option.hidden = k !== Number(select.value); });
    chooser.hidden = options.length < 2;
    select.addEventListener("change", show);
    show();
  }

  // Values under the pointer: lines are read from the drawing itself.
  const FEW = 2 * 60;  // numbers of a line whose points count one by one
  const figures = (value) => !value ? "0" : Math.abs(value) >= 1e5 || Math.abs(value) < 1e-3
    ? value.toExponential(2) : String(Number(value.toPrecision(3)));
  const unit = (label) => { const found = /\[([^\]]*)\]/.exec(label); return found && found[1] !== "–" ? " " + found[1] : ""; };
  const pointsOf = (group) => {
    const path = group && group.querySelector("path");
    const numbers = path ? (path.getAttribute("d").match(/-?[\d.]+/g) || []).map(Number) : [];
    return numbers.length % 2 ? [] : numbers;
  };
  const heightAt = (points, x) => {
    for (let k = 2; k < points.length; k += 2) {
      const [a, b] = [points[k - 2], points[k]];
      if (a <= x && x <= b) return points[k - 1] + (points[k + 1] - points[k - 1]) * (b > a ? (x - a) / (b - a) : 0);
    }
    return null;
  };
  for (const drawing of document.querySelectorAll("[data-readout]")) {
    const svg = drawing.querySelector("svg");
    let axes = null, words = null, cursor = null;
    const begin = () => {
      const prefix = drawing.parentElement.getAttribute("aria-labelledby").replace(/title$/, "");
      axes = JSON.parse(drawing.dataset.readout);
      for (const one of axes) for (const line of one.lines) line.push(pointsOf(svg.getElementById(prefix + line[0])));
      words = document.createElement("div");
      words.className = "readout";
      words.setAttribute("aria-hidden", "true");
      drawing.parentElement.append(words);
      cursor = document.createElementNS("http://www.w3.org/2000/svg", "path");
      cursor.setAttribute("class", "cursor");
      svg.append(cursor);
    };
    const leave = () => { if (words) { words.hidden = true; cursor.setAttribute("d", ""); } };
    drawing.addEventListener("pointermove", (event) => {
      if (!axes) begin();
      const place = svg.getBoundingClientRect(), view = svg.viewBox.baseVal;
      let x = (event.clientX - place.left) / place.width * view.width;
      const few = axes[0].lines[0][2];
      if (few.length && few.length <= FEW) {
        for (let k = 0, best = Infinity, at = x; k < few.length; k += 2) {
          if (Math.abs(few[k] - at) < best) { best = Math.abs(few[k] - at); x = few[k]; }
        }
      }
      const lines = [];
      let head = "", bars = "";
      for (const one of axes) {
        const [left, top, width, height] = one.box;
        if (x < left || x > left + width) continue;
        const at = one.x[0] + (x - left) / width * (one.x[1] - one.x[0]);
        head = one.labels[0].replace(/\s*\[.*$/, "") + " " + figures(at) + unit(one.labels[0]);
        bars += `M${x} ${top}V${top + height}`;
        for (const [, label, points] of one.lines) {
          const y = heightAt(points, x);
          if (y === null) continue;
          const share = (top + height - y) / height, [low, high] = one.y;
          const value = one.log ? low * (high / low) ** share : low + share * (high - low);
          const share_of = one.labels[1].startsWith("share");
          lines.push(label + " " + (share_of ? figures(100 * value) + " %" : figures(value) + unit(one.labels[1])));
        }
      }
      words.hidden = !lines.length;
      words.classList.toggle("left", x > view.width / 2);
      words.replaceChildren(...[head, ...lines].flatMap((text, k) => k ? [document.createElement("br"), text] : [text]));
      cursor.setAttribute("d", lines.length ? bars : "");
    });
    drawing.addEventListener("pointerleave", leave);
  }

  // Folded parts are printed too; they close again afterwards.
  let opened = [];
  addEventListener("beforeprint", () => {
    opened = [...document.querySelectorAll("details:not([open])")];
    opened.forEach((part) => { part.open = true; });
  });
  addEventListener("afterprint", () => opened.forEach((part) => { part.open = false; }));
})();
