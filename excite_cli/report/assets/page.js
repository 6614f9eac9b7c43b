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

  // The contents say which section is being read: the last that begins above the middle.
  const links = [...document.querySelectorAll("nav a")];
  const sections = links.map((link) => document.getElementById(link.hash.slice(1)));
  const mark = () => {
    const read = sections.findLastIndex((section) => section.getBoundingClientRect().top < innerHeight / 3);
    links.forEach((link, k) => { if (k === read) link.setAttribute("aria-current", "true"); else link.removeAttribute("aria-current"); });
  };
  addEventListener("scroll", mark, { passive: true });
})();
