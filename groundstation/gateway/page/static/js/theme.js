// Dark for the cabin, sunlight for outside; what was chosen is kept by the browser.

import { write } from "./dom.js";

const KEPT = "borechain-theme";
const OTHER = { dark: "sunlight", sunlight: "dark" };

/** Have a button change the theme; it names the other one. */
export function connectTheme(button) {
  let theme = localStorage.getItem(KEPT);
  if (!(theme in OTHER)) theme = matchMedia("(prefers-color-scheme: light)").matches ? "sunlight" : "dark";

  function show() {
    document.documentElement.dataset.theme = theme;
    write(button, theme === "dark" ? "Sunlight" : "Dark");
  }

  button.addEventListener("click", () => {
    theme = OTHER[theme];
    localStorage.setItem(KEPT, theme);
    show();
  });
  show();
}
