"use strict";
// Numbers that the page holds as text; gaitopt/viewing/replay/numbers.py writes them.
const bytesOf = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));

// A table of numbers, one array a column. Differences of neighbours are in 7 bits a byte, and the
// sign of each in its lowest bit. Products instead of shifts, which would cut off at 32 bits.
function columnsOf({ rows, columns, unit, bytes: text }) {
  const bytes = bytesOf(text), out = [];
  let at = 0;
  for (let c = 0; c < columns; c++) {
    const column = new Float64Array(rows);
    let whole = 0;
    for (let r = 0; r < rows; r++) {
      let number = 0, scale = 1, byte;
      do {
        byte = bytes[at++];
        number += (byte & 127) * scale;
        scale *= 128;
      } while (byte > 127);
      whole += number % 2 ? -(number + 1) / 2 : number / 2;
      column[r] = unit * whole;
    }
    out.push(column);
  }
  return out;
}

// How many of ascending numbers have come.
function countUpTo(times, time) {
  let low = 0, high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle + 1; else high = middle;
  }
  return low;
}
