// Reads values off a figure under the mouse; a drag enlarges what it covers, a double click shows the whole again.
// Without scripts the figures are what they are: plain SVG.
for (const svg of document.querySelectorAll("figure svg[data-x]")) {
  const readout = document.createElement("output");
  const frame = document.createElementNS(svg.namespaceURI, "rect");
  const whole = svg.getAttribute("viewBox");
  const [, , width, height] = whole.split(" ").map(Number);
  const sized = ["stroke-width", "r"].flatMap((name) =>
    [...svg.querySelectorAll(`[${name}]`)].map((mark) => [mark, name, Number(mark.getAttribute(name))]));
  let start = null;

  svg.after(readout);
  frame.setAttribute("class", "selection");
  svg.append(frame);

  const place = (event) => new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
  // An axis: pixels and values at its two ends, whether the values are logarithms, its title.
  const value = (axis, at) => {
    const [from, to, low, high] = svg.dataset[axis].split(" ").map(Number);
    const share = (at - from) / (to - from);
    const linear = low + share * (high - low);
    const shown = axis + "Log" in svg.dataset ? 10 ** linear : linear;
    const title = svg.dataset[axis + "Title"];
    return share < 0 || share > 1 ? null : title ? `${title}: ${+shown.toPrecision(4)}` : "";
  };
  const show = (box) => {
    const share = Number(box.split(" ")[2]) / width;
    svg.setAttribute("viewBox", box);
    svg.style.setProperty("--share", share);
    for (const [mark, name, size] of sized) mark.setAttribute(name, size * share);
  };
  const selection = (end) => [Math.min(start.x, end.x), Math.min(start.y, end.y),
    Math.abs(end.x - start.x), Math.abs(end.y - start.y)];

  svg.addEventListener("pointerdown", (event) => {
    if (event.pointerType !== "mouse" || event.button !== 0) return;
    start = place(event);
    svg.setPointerCapture(event.pointerId);
  });
  svg.addEventListener("pointermove", (event) => {
    const at = place(event);
    const values = [value("x", at.x), value("y", at.y)];
    const hint = svg.getAttribute("viewBox") === whole ? "drag to enlarge" : "double click for the whole";
    readout.textContent = values.includes(null) ? "" : [...values.filter(Boolean), hint].join(" · ");
    if (start) {
      const box = selection(at);
      ["x", "y", "width", "height"].forEach((name, i) => frame.setAttribute(name, box[i]));
    }
  });
  svg.addEventListener("pointerup", (event) => {
    if (!start) return;
    const [x, y, w, h] = selection(place(event));
    start = null;
    frame.setAttribute("width", 0);
    // Less than that is a click. The shape of the figure stays, around the middle of what was marked.
    if (w > width / 100 && h > height / 100) {
      const share = Math.max(w / width, h / height);
      show(`${x + (w - share * width) / 2} ${y + (h - share * height) / 2} ${share * width} ${share * height}`);
    }
  });
  svg.addEventListener("dblclick", () => show(whole));
  svg.addEventListener("pointerleave", () => { readout.textContent = ""; });
  addEventListener("beforeprint", () => show(whole));
}
