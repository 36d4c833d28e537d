/* Draws the figures of a report: each has its data beside it (see interactive.py). */

"use strict";

for (const data of document.querySelectorAll("script.chart-data")) {
  const told = JSON.parse(data.textContent);
  const element = data.previousElementSibling;
  if (told.panels) {
    element.chart = new HeatMap(element, told);
    continue;
  }
  element.chart = new Chart(element, { height: 340, whole: true, ...told });
  const times = told.times.map((one) => (typeof one === "number" ? told.times[one] : one));
  element.chart.draw(times, told.values, { levels: told.levels, marks: told.marks, bands: told.bands });
}
