// A picture in a frame: it fits at first; the wheel with Ctrl and two buttons make it larger.

const STEP = 1.25;
const MOST = 4;
// A frame is as high as its picture: at most so much of the window, at least so many pixels.
const HIGHEST = 0.72;
const LOWEST = 260;

export class Zoom {
  constructor(frame) {
    this.frame = frame;
    this.scale = 1;
    frame.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.metaKey) return;
      event.preventDefault();
      this.by(event.deltaY < 0 ? STEP : 1 / STEP, event);
    }, { passive: false });
  }

  // Shows all of a picture: as large as it is, or smaller.
  fit(svg) {
    this.svg = svg;
    const { width, height } = svg.viewBox.baseVal;
    const tall = innerHeight * HIGHEST;
    this.least = Math.min(1, this.frame.clientWidth / width, tall / height);
    this.frame.style.height = `${
      Math.ceil(Math.min(Math.max(height * this.least, LOWEST), tall)) + 2
    }px`;
    this.set(this.least);
  }

  // After the frame has become wider or narrower: what fitted fits again.
  refit() {
    if (this.svg && this.scale === this.least) this.fit(this.svg);
  }

  in() {
    this.by(STEP);
  }
  out() {
    this.by(1 / STEP);
  }
  all() {
    if (this.svg) this.set(this.least);
  }

  // What is under the pointer, or in the middle, stays there.
  by(factor, event = null) {
    if (!this.svg) return;
    const { frame } = this;
    const box = frame.getBoundingClientRect();
    const [x, y] = event
      ? [event.clientX - box.left, event.clientY - box.top]
      : [frame.clientWidth / 2, frame.clientHeight / 2];
    const [left, top] = [(frame.scrollLeft + x) / this.scale, (frame.scrollTop + y) / this.scale];
    this.set(Math.min(Math.max(this.scale * factor, Math.min(this.least, 0.1)), MOST));
    frame.scrollLeft = left * this.scale - x;
    frame.scrollTop = top * this.scale - y;
  }

  set(scale) {
    this.scale = scale;
    const { width, height } = this.svg.viewBox.baseVal;
    this.svg.setAttribute("width", Math.floor(width * scale));
    this.svg.setAttribute("height", Math.floor(height * scale));
  }
}
