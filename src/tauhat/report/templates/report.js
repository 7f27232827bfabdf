(() => {
  "use strict";
  const root = document.documentElement;
  const settings = {
    responsive: true, displaylogo: false, plotlyServerURL: "", // logs stay on this machine: no button that uploads them
    modeBarButtonsToRemove: ["sendChartToCloud", "lasso2d", "select2d", "autoScale2d"],
  };
  const printWidth = 680;
  const drawn = new Set();

  const colour = (name) => getComputedStyle(root).getPropertyValue(name).trim();

  function template() {
    const axis = {
      gridcolor: colour("--line"), zerolinecolor: colour("--edge"), linecolor: colour("--edge"), tickcolor: colour("--edge"),
      showline: true, ticks: "outside", automargin: true, title: { standoff: 8 },
    };
    return { layout: {
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      font: { color: colour("--text"), family: getComputedStyle(document.body).fontFamily, size: 13 },
      hoverlabel: { bgcolor: colour("--panel"), bordercolor: colour("--edge"), font: { color: colour("--text") } },
      modebar: { color: colour("--quiet"), activecolor: colour("--text"), bgcolor: "rgba(0,0,0,0)" },
      xaxis: axis, yaxis: axis,
    } };
  }

  function draw(place) {
    if (drawn.has(place) || place.closest("details:not([open])")) return;
    drawn.add(place);
    const figure = JSON.parse(document.getElementById(place.dataset.source).textContent);
    figure.layout.template = template();
    Plotly.newPlot(place, figure.data, figure.layout, settings);
  }

  function drawAll(places) {
    const queue = Array.from(places);
    const next = () => {
      const place = queue.shift();
      if (!place) return;
      draw(place);
      setTimeout(next, 0);
    };
    next();
  }

  function restyle(size) {
    for (const place of drawn) Plotly.relayout(place, { template: template(), ...size });
  }

  drawAll(document.querySelectorAll(".plot"));
  for (const part of document.querySelectorAll("details")) {
    part.addEventListener("toggle", () => { if (part.open) drawAll(part.querySelectorAll(".plot")); });
  }
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => restyle({}));
  addEventListener("beforeprint", () => {
    root.classList.add("printing");
    for (const place of drawn) {
      const width = Math.min(printWidth, place.clientWidth);
      Plotly.relayout(place, { template: template(), width });
    }
  });
  addEventListener("afterprint", () => {
    root.classList.remove("printing");
    restyle({ width: null, autosize: true });
  });
})();
