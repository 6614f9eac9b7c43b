"use strict";
// Charts of the page: its numbers, drawn by uPlot in the colours of the style sheet.
(() => {
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue("--" + name).trim();
  const figures = (value) => value === null || value === undefined ? "" : !value ? "0" : Math.abs(value) >= 1e5 || Math.abs(value) < 1e-3
    ? value.toExponential(2) : String(Number(value.toPrecision(4)));
  const decoded = (told) => {
    const bytes = Uint8Array.from(atob(told.d), (letter) => letter.charCodeAt(0));
    const whole = new DataView(bytes.buffer), values = new Array(bytes.length / 2);
    for (let k = 0; k < values.length; k++) {
      const at = whole.getInt16(2 * k, true);
      values[k] = at === -32768 ? null : at === 32767 ? undefined : told.lo + (at + 32767) * told.step;
    }
    return values;
  };
  const ticks = (_, splits) => splits.map((value) => Math.abs(value) >= 1e5 || (value && Math.abs(value) < 1e-3) ? Number(value.toPrecision(3)).toExponential().replace("e+", "e") : figures(value));
  const powers = (values) => values.map((value) => value == null ? value : 10 ** value);
  // Ticks of a logarithmic axis: powers of ten, with 2 and 5 between them on few decades, or even
  // steps within less than one.
  const decades = (plot, _, low, high) => {
    const found = [], wide = Math.log10(high / low);
    if (wide < 0.7) {
      const size = (high - low) / 5, ten = 10 ** Math.floor(Math.log10(size));
      const step = ten * ([1, 2, 5, 10].find((each) => each * ten >= size) || 10);
      for (let at = Math.ceil(low / step) * step; at <= high; at += step) found.push(Number(at.toPrecision(12)));
      return found;
    }
    const every = Math.max(1, Math.ceil(wide / 6));
    for (let power = Math.floor(Math.log10(low)); power <= Math.ceil(Math.log10(high)); power++) {
      if (power % every) continue;
      for (const times of wide < 2.5 ? [1, 2, 5] : [1]) found.push(Number((times * 10 ** power).toPrecision(12)));
    }
    return found.filter((at) => at >= low && at <= high);
  };
  const WHOLE = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000];
  const groups = new Map();  // link → { range, plots }
  const groupOf = (link) => {
    if (!groups.has(link)) groups.set(link, { range: null, plots: new Set() });
    return groups.get(link);
  };
  const DASHES = { dashed: [5, 3], dotted: [2, 2] };
  const FONT = 'system-ui, "Segoe UI", Roboto, "Helvetica Neue", "DejaVu Sans", sans-serif';
  let paper = false;
  const font = (size) => (paper ? 0.75 * size : size) + "px " + FONT;

  // The sample of a series that is nearest to the cursor and known.
  const nearest = (plot, series, index) => {
    const y = plot.data[series], x = plot.data[0];
    if (!series || y[index] != null) return index;
    let before = index, after = index;
    while (before > 0 && y[before] == null) before--;
    while (after < y.length - 1 && y[after] == null) after++;
    const [a, b] = [y[before] == null ? Infinity : x[index] - x[before], y[after] == null ? Infinity : x[after] - x[index]];
    const found = a <= b ? before : after;
    const far = Math.abs(plot.valToPos(x[found], "x") - plot.valToPos(x[index], "x"));
    return far < 24 && y[found] != null ? found : index;
  };

  const ground = (told, panel) => (plot) => {
    const { ctx, bbox } = plot;
    const [left, top, right, bottom] = [bbox.left, bbox.top, bbox.left + bbox.width, bbox.top + bbox.height];
    const at = (value, axis) => plot.valToPos(value, axis, true);
    ctx.save();
    ctx.beginPath();
    ctx.rect(left, top, bbox.width, bbox.height);
    ctx.clip();
    ctx.fillStyle = colour("shaded");
    for (const [from, to] of told.shaded) ctx.fillRect(at(from, "x"), top, at(to, "x") - at(from, "x"), bbox.height);
    ctx.fillStyle = colour("forbidden");
    if (panel.noise) {
      ctx.fillStyle = colour("shaded");
      ctx.fillRect(left, at(panel.noise, "y"), bbox.width, at(-panel.noise, "y") - at(panel.noise, "y"));
      ctx.fillStyle = colour("forbidden");
    }
    const [low, high] = panel.limits;
    if (low !== null) ctx.fillRect(left, at(low, "y"), bbox.width, bottom - at(low, "y"));
    if (high !== null) ctx.fillRect(left, top, bbox.width, at(high, "y") - top);
    ctx.strokeStyle = colour("limit");
    ctx.setLineDash([8, 5]);
    for (const limit of panel.limits) {
      if (limit === null) continue;
      ctx.beginPath();
      ctx.moveTo(left, at(limit, "y"));
      ctx.lineTo(right, at(limit, "y"));
      ctx.stroke();
    }
    ctx.restore();
  };

  const whiskers = (ends) => (plot) => {
    const { ctx } = plot;
    for (const [series, low, high, name] of ends) {
      if (!plot.series[series].show) continue;
      ctx.save();
      ctx.strokeStyle = colour(name);
      ctx.globalAlpha = 0.7;
      ctx.lineWidth = devicePixelRatio;
      for (let k = 0; k < low.length; k++) {
        if (low[k] == null) continue;
        const x = plot.valToPos(plot.data[0][k], "x", true);
        ctx.beginPath();
        ctx.moveTo(x, plot.valToPos(low[k], "y", true));
        ctx.lineTo(x, plot.valToPos(high[k], "y", true));
        ctx.stroke();
      }
      ctx.restore();
    }
  };

  // A figure in the corner, on paper of its own.
  const corner = (text) => (plot) => {
    if (!text) return;
    const { ctx, bbox } = plot, size = devicePixelRatio, right = bbox.left + bbox.width - 4 * size;
    ctx.save();
    ctx.font = font(11.5 * size);
    ctx.textAlign = "right";
    ctx.textBaseline = "top";
    const wide = ctx.measureText(text).width;
    ctx.globalAlpha = 0.85;
    ctx.fillStyle = colour("card");
    ctx.fillRect(right - wide - 3 * size, bbox.top, wide + 7 * size, 17 * size);
    ctx.globalAlpha = 1;
    ctx.fillStyle = colour("ink");
    ctx.fillText(text, right, bbox.top + 3 * size);
    ctx.restore();
  };

  const seriesOf = (one) => {
    const rings = one.look === "rings", dots = rings || one.look === "dots" || one.look === "marks";
    const pen = () => colour(one.colour);
    return {
      label: one.label,
      stroke: pen,
      width: one.look === "band" ? 6 : one.look === "dotted" ? 1.2 : 1.4,
      dash: DASHES[one.look],
      paths: dots ? () => null : one.look === "steps" ? uPlot.paths.stepped({ align: 1 }) : undefined,
      points: { show: dots || one.look === "joined" || one.look === "steps", size: one.look === "dots" ? 3.5 : one.look === "marks" ? 6.5 : rings ? 9 : 5, fill: rings ? () => colour("card") : pen, stroke: pen, width: rings ? 1.5 : 0 },
      alpha: one.look === "band" ? 0.4 : one.look === "dots" ? 0.6 : 1,
      value: (_, value) => value == null ? "" : figures(Number(value.toPrecision(3))),
    };
  };

  const build = (holder) => {
    const told = holder.told || (holder.told = JSON.parse(holder.dataset.plot));
    if (!holder.numbers) {
      const x = decoded(told.x);
      holder.numbers = told.panels.map((panel) => ({
        data: [x, ...panel.series.map((one) => panel.logarithmic ? powers(decoded(one.y)) : decoded(one.y))],
        ends: panel.series.flatMap((one, k) => one.low ? [[k + 1, decoded(one.low), decoded(one.high), one.colour]] : []),
      }));
      holder.replaceChildren();
    }
    const group = groupOf(told.link || holder.id);
    const key = "cursor-" + (told.link || holder.id);
    holder.plots = told.panels.map((panel, number) => {
      const last = number === told.panels.length - 1;
      const { data, ends } = holder.numbers[number];
      const axis = { stroke: () => colour("ink"), grid: { stroke: () => colour("grid"), width: 1 }, ticks: { stroke: () => colour("grid"), width: 1, size: 5 }, font: font(12), labelFont: font(12), values: ticks };
      const across = { space: told.counted ? 30 : 44, ...(told.counted ? { incrs: WHOLE } : {}) };
      const shown = () => told.span || [data[0][0], data[0][data[0].length - 1]];
      let telling = false;
      const plot = new uPlot({
        width: holder.clientWidth,
        class: last ? "lowest" : "upper",
        title: panel.axis,
        height: (paper ? 0.7 : 1) * panel.height + (last ? 34 : 0),
        padding: [8, 8, 0, 0],
        cursor: { sync: { key, setSeries: false, scales: ["x", null], filters: { pub: (type) => type === "mousemove" || type === "mouseleave" } }, drag: { x: true, y: false, setScale: true }, dataIdx: nearest, points: { size: 6 } },
        legend: { live: true, markers: { width: 2 } },
        scales: { x: { time: false, range: (_, low, high) => low === null ? shown() : [low, high] }, y: panel.span ? { range: panel.span } : panel.logarithmic ? { distr: 3, range: (_, low, high) => low === null ? [1, 10] : [low * 0.85, high * 1.18] } : {} },
        axes: [
          last ? { ...axis, ...across, label: told.axis, labelSize: 20, size: 32, gap: 2 } : { ...axis, ...across, size: 4, values: () => [] },
          { ...axis, size: paper ? 34 : 46, gap: 3, space: 34, ...(panel.logarithmic ? { splits: decades, filter: (_, splits) => splits } : {}) },
        ],
        series: [{ label: told.axis.replace(/\s*\[.*$/, ""), value: (_, value) => figures(value) }, ...panel.series.map(seriesOf)],
        hooks: {
          drawClear: [ground(told, panel)],
          draw: [whiskers(ends), corner(panel.corner)],
          setScale: [(own, name) => {
            if (name !== "x" || telling || own.busy) return;
            const { min, max } = own.scales.x, [low, high] = shown();
            group.range = min <= low && max >= high ? null : [min, max];
            telling = true;
            for (const other of group.plots) if (other !== own) { other.busy = true; other.setScale("x", { min, max }); other.busy = false; }
            telling = false;
          }],
        },
      }, data, holder);
      plot.root.insertBefore(plot.root.querySelector(".u-legend"), plot.root.querySelector(".u-wrap"));
      plot.root.querySelectorAll(".u-series").forEach((row, k) => row.classList.add(k ? panel.series[k - 1].look : "over"));
      plot.busy = true;
      const [min, max] = group.range || shown();
      plot.setScale("x", { min, max });
      plot.busy = false;
      group.plots.add(plot);
      return plot;
    });
    holder.group = group;
  };
  const remove = (holder) => {
    for (const plot of holder.plots || []) { holder.group.plots.delete(plot); plot.destroy(); }
    holder.plots = null;
  };

  const holders = [...document.querySelectorAll(".plot")];
  const seen = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) if (isIntersecting && !target.plots && target.clientWidth) build(target);
  }, { rootMargin: "300px" });
  const sized = new ResizeObserver((entries) => {
    for (const { target } of entries) {
      if (paper || !target.clientWidth) continue;
      for (const plot of target.plots || []) if (plot.width !== target.clientWidth) plot.setSize({ width: target.clientWidth, height: plot.height });
    }
  });
  for (const holder of holders) { seen.observe(holder); sized.observe(holder); }

  // Keys: arrows move the cursor, + and − zoom about it, Escape shows all.
  const words = (holder) => holder.plots.flatMap((plot, number) => plot.series.slice(1).map((series, k) => {
    const index = nearest(plot, k + 1, plot.cursor.idx), value = plot.data[k + 1][index];
    return value == null ? "" : series.label + " " + figures(value) + (holder.told.panels[number].axis.match(/\[([^\]–]*)\]/) || ["", ""])[1].replace(/^/, " ");
  })).filter(Boolean).join(", ");
  for (const holder of holders) {
    holder.addEventListener("keydown", (event) => {
      if (!holder.plots) build(holder);
      const plot = holder.plots[0], x = plot.data[0];
      const here = plot.cursor.idx ?? Math.floor(x.length / 2), { min, max } = plot.scales.x;
      const zoom = (share) => plot.setScale("x", { min: x[here] - (x[here] - min) * share, max: x[here] + (max - x[here]) * share });
      const step = event.shiftKey ? Math.ceil(x.length / 20) : 1;
      if (event.key === "ArrowLeft" || event.key === "ArrowRight") {
        const next = Math.min(Math.max(here + (event.key === "ArrowLeft" ? -step : step), 0), x.length - 1);
        for (const each of holder.plots) each.setCursor({ left: each.valToPos(x[next], "x"), top: 20 });
        const said = document.getElementById("spoken");
        said.textContent = figures(x[next]) + ": " + words(holder);
      } else if (event.key === "+") zoom(0.6);
      else if (event.key === "-") zoom(1 / 0.6);
      else if (event.key === "Escape") { const [low, high] = holder.told.span || [x[0], x[x.length - 1]]; plot.setScale("x", { min: low, max: high }); }
      else return;
      event.preventDefault();
    });
  }

  const anew = (every) => { for (const holder of holders) { const was = holder.plots; remove(holder); if ((was || every) && holder.clientWidth) build(holder); } };
  new MutationObserver(() => anew(false)).observe(document.documentElement, { attributes: true, attributeFilter: ["data-theme"] });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => anew(false));
  // On paper every chart is drawn, as wide as a column there, in the colours of paper.
  const print = matchMedia("print");
  const toPaper = () => {
    if (paper) return;
    paper = true;
    for (const holder of holders) {
      remove(holder);
      Object.defineProperty(holder, "clientWidth", { value: holder.closest(".wide") ? 680 : 218, configurable: true });
      build(holder);
    }
  };
  const fromPaper = () => { if (!paper) return; paper = false; for (const holder of holders) { remove(holder); delete holder.clientWidth; if (holder.clientWidth) build(holder); } };
  addEventListener("beforeprint", toPaper);
  addEventListener("afterprint", fromPaper);
  print.addEventListener("change", (event) => event.matches ? toPaper() : fromPaper());
})();
