// Messages that did not arrive: a cross at the end of the publication, on the row of the subscription.

// Flags of such a bar, see bar.sql.
const DROPPED = 16;
const LOST = 32;
const SIZE = 3.5;
// Crosses that lie closer together are one.
const LEAST_DISTANCE = 4;

export function missingWords(flags) {
  const words = [flags & DROPPED && "dropped: a queue was full", flags & LOST && "lost on the way"]
    .filter(Boolean);
  return words.join(", or ") || "not taken, and the trace does not tell why";
}

// Draws the crosses of a row and remembers where the last one was.
export class Crosses {
  constructor(context, colors) {
    this.context = context;
    this.colors = colors;
    this.last = -Infinity;
  }

  draw(x, y, flags) {
    if (x - this.last < LEAST_DISTANCE) return;
    this.last = x;
    const { context: c } = this;
    c.beginPath();
    c.moveTo(x - SIZE, y - SIZE);
    c.lineTo(x + SIZE, y + SIZE);
    c.moveTo(x + SIZE, y - SIZE);
    c.lineTo(x - SIZE, y + SIZE);
    // An edge of the page's colour: the cross may lie on a bar of any colour.
    c.strokeStyle = this.colors.page;
    c.lineWidth = 4;
    c.stroke();
    c.strokeStyle = flags & (DROPPED | LOST) ? this.colors.error : this.colors.soft;
    c.lineWidth = 1.8;
    c.stroke();
  }
}
