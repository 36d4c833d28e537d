/* What is folded is printed, too. */

"use strict";

const foldedOpened = [];
addEventListener("beforeprint", () => {
  for (const one of document.querySelectorAll("details:not([open])")) {
    one.open = true;
    foldedOpened.push(one);
  }
});
addEventListener("afterprint", () => {
  for (const one of foldedOpened.splice(0)) one.open = false;
});
