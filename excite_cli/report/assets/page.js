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

  // Folded parts are printed too; they close again afterwards.
  let opened = [];
  addEventListener("beforeprint", () => {
    opened = [...document.querySelectorAll("details:not([open])")];
    opened.forEach((part) => { part.open = true; });
  });
  addEventListener("afterprint", () => opened.forEach((part) => { part.open = false; }));
})();
