"use strict";
// Keys of the replay, and the panel that lists them. They act only where nothing else wants them: a
// list takes its arrows, a button its space bar, and nothing is taken from a field for text.
function addKeys(keys) {
  const rows = document.getElementById("keys");
  for (const { shown, does } of keys) {
    const row = document.createElement("tr"), name = document.createElement("td");
    const text = document.createElement("td"), key = document.createElement("kbd");
    key.textContent = shown;
    name.append(key);
    text.textContent = does;
    row.append(name, text);
    rows.append(row);
  }
  const wanted = (target, key) => {
    const tag = target && target.tagName;
    if (tag === "SELECT" || tag === "TEXTAREA" || target && target.isContentEditable) return true;
    if (tag === "INPUT") return target.type !== "range";
    return tag === "BUTTON" && (key === " " || key === "Enter");
  };
  window.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || wanted(event.target, event.key)) return;
    const one = keys.find(({ key }) => [key].flat().includes(event.key))
      || keys.find(({ key }) => [key].flat().includes(event.key.toLowerCase()));
    if (!one) return;
    event.preventDefault();
    one.act(event);
  });
}

// A panel that the key ?, the button and Escape open and close; it takes the focus and gives it back.
function makeHelp() {
  const panel = document.getElementById("help"), button = document.getElementById("ask");
  const show = (open) => {
    panel.hidden = !open;
    button.setAttribute("aria-expanded", String(open));
    if (open) panel.focus(); else button.blur();
  };
  button.addEventListener("click", () => show(panel.hidden));
  document.getElementById("close").addEventListener("click", () => show(false));
  return { toggle: () => show(panel.hidden), close: () => show(false) };
}
