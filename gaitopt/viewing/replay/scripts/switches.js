"use strict";
// Buttons that show and hide frames, each with its legend. Returns the keys that do the same; the
// address may say what is shown at first, as in replay.html#steppable&no-region.
function addSwitches(viewer, switches, hash, dot) {
  const el = (id) => document.getElementById(id), keys = [];
  for (const { name, title, key, frame, shown: first, legend } of switches) {
    const button = document.createElement("button"), names = document.createElement("div");
    let shown = true;
    const turn = () => {
      shown = !shown;
      viewer.set_property(frame.split("/"), "visible", shown);
      button.setAttribute("aria-pressed", String(shown));
      names.hidden = !shown;
    };
    names.className = "legend";
    for (const [text, colour] of legend) {
      const entry = document.createElement("span");
      entry.append(dot(colour), text);
      names.append(entry);
    }
    if (legend.length) el("about").append(names);
    Object.assign(button, { title, textContent: name, onclick: turn });
    button.setAttribute("aria-pressed", "true");
    button.addEventListener("pointerup", () => button.blur());
    el("follow").before(button);
    const does = title.replace(/ \([A-Z]\)$/, "");
    keys.push({ key, shown: key.toUpperCase(), does, act: turn });
    const word = name.toLowerCase();
    if (hash.has(`no-${word}`) || !first && !hash.has(word)) turn();
  }
  return keys;
}
