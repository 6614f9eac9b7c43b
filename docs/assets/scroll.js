"use strict";
// What is wider than the page can be scrolled with the keys, too.
const reach = () => {
  for (const part of document.querySelectorAll(".md-typeset__scrollwrap, .md-typeset pre > code")) {
    if (part.scrollWidth <= part.clientWidth) continue;
    part.tabIndex = 0;
    part.setAttribute("role", "group");
    part.setAttribute("aria-label", part.matches("code") ? "Code" : "Table");
  }
};
addEventListener("load", reach);
addEventListener("resize", reach);
