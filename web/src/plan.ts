// The path seen from above, with a scale in metres.
import { lengthUnit, Run, Submap, unbrokenParts } from './data';
import { h, plain, plural, roundedDown, svg } from './dom';

type Point = [number, number];
const kWidth = 860, kMaxHeight = 560, kMargin = 34;

// Projects positions on the horizontal plane: the viewing direction of the first camera is upward in the drawing, unless
// the path is much longer in that direction.
function projection(submap: Submap): (values: ArrayLike<number>, i: number) => Point {
  const up = submap.up;
  let forward = [-up[2] * up[0], -up[2] * up[1], 1 - up[2] * up[2]];
  if (Math.hypot(...forward) < 0.2) forward = [-up[1] * up[0], 1 - up[1] * up[1], -up[1] * up[2]];
  const norm = Math.hypot(...forward), f = forward.map((v) => v / norm);
  const r = [f[1] * up[2] - f[2] * up[1], f[2] * up[0] - f[0] * up[2], f[0] * up[1] - f[1] * up[0]];
  const dot = (a: number[], v: ArrayLike<number>, i: number) => a[0] * v[3 * i] + a[1] * v[3 * i + 1] + a[2] * v[3 * i + 2];
  return (values, i) => [dot(r, values, i), dot(f, values, i)];
}

function bounds(points: Point[]): [number, number, number, number] {
  let [left, bottom, right, top] = [Infinity, Infinity, -Infinity, -Infinity];
  for (const [x, y] of points) {
    left = Math.min(left, x); right = Math.max(right, x); bottom = Math.min(bottom, y); top = Math.max(top, y);
  }
  return [left, bottom, right, top];
}

// Points of a line, without those that would be drawn within half a pixel of the previous one.
function pathData(points: Point[]): string {
  let text = '', last: Point = [NaN, NaN];
  points.forEach((p, i) => {
    if (i > 0 && i < points.length - 1 && Math.hypot(p[0] - last[0], p[1] - last[1]) < 0.5) return;
    text += `${i === 0 ? 'M' : 'L'}${p[0].toFixed(1)} ${p[1].toFixed(1)}`;
    last = p;
  });
  return text;
}

const all = (values: ArrayLike<number>, project: (v: ArrayLike<number>, i: number) => Point) =>
  Array.from({ length: values.length / 3 }, (_, i) => project(values, i));

function gridLines(from: number, to: number, step: number): number[] {
  const lines = [];
  for (let v = Math.ceil(from / step) * step; v <= to; v += step) lines.push(v);
  return lines;
}

function drawing(run: Run, submap: Submap, truth: Float32Array | null): SVGElement {
  const flat = projection(submap);
  let project = flat;
  const raw = all(submap.path.position, flat).concat(truth ? all(truth, flat) : []);
  const [l, b, r, t] = bounds(raw);
  if (t - b > 1.3 * (r - l)) project = (v, i) => { const [x, y] = flat(v, i); return [y, -x]; };
  let [left, bottom, right, top] = bounds(raw.map(([x, y]) => (project === flat ? [x, y] : [y, -x]) as Point));
  const minimum = Math.max(right - left, top - bottom, 1e-3) * 0.22;  // a straight path has some space around it
  const widen = (low: number, high: number): Point => high - low < minimum ? [(low + high - minimum) / 2, (low + high + minimum) / 2] : [low, high];
  [left, right] = widen(left, right);
  [bottom, top] = widen(bottom, top);
  const scale = Math.min((kWidth - 2 * kMargin) / (right - left), (kMaxHeight - 2 * kMargin) / (top - bottom));
  const height = (top - bottom) * scale + 2 * kMargin, offset = (kWidth - (right - left) * scale) / 2;
  const place = ([x, y]: Point): Point => [offset + (x - left) * scale, height - kMargin - (y - bottom) * scale];
  const points = (values: ArrayLike<number>) => all(values, project).map(place);

  const step = roundedDown(Math.max(right - left, top - bottom) / 4);
  const [x0, x1] = [left - (offset - 4) / scale, right + (offset - 4) / scale], margin = (kMargin - 4) / scale;
  const grid = svg('g', { class: 'grid' },
    ...gridLines(x0, x1, step).map((x) => svg('line', { x1: place([x, 0])[0], x2: place([x, 0])[0], y1: 4, y2: height - 4 })),
    ...gridLines(bottom - margin, top + margin, step).map((y) => svg('line', { x1: 4, x2: kWidth - 4, y1: place([0, y])[1], y2: place([0, y])[1] })));

  const path = points(submap.path.position), parts = unbrokenParts(run, submap);
  const children: SVGElement[] = [grid];
  if (truth) children.push(svg('path', { class: 'truth', d: pathData(points(truth)) }));
  parts.forEach(([from, to], i) => {
    if (i > 0) children.push(svg('path', { class: 'gap', d: pathData([path[from - 1], path[from]]) }));
    children.push(svg('path', { class: 'estimate', d: pathData(path.slice(from, to)) }));
  });
  const keyframes = points(submap.keyframes.position);
  if (!submap.loaded) children.push(svg('g', { class: 'keyframes' }, ...keyframes.map(([cx, cy]) => svg('circle', { cx, cy, r: 1.8 }))));
  for (const loop of submap.loops) {
    const ends = loop.map((k) => keyframes[k]);
    children.push(svg('path', { class: 'loop', d: pathData(ends) }), svg('circle', { class: 'loop', cx: ends[0][0], cy: ends[0][1], r: 5 }));
  }
  children.push(svg('circle', { class: 'start', cx: path[0][0], cy: path[0][1], r: 5 }),
    svg('rect', { class: 'end', x: path[path.length - 1][0] - 4.5, y: path[path.length - 1][1] - 4.5, width: 9, height: 9 }));
  const bar = step * scale;
  children.push(svg('g', { class: 'bar' }, svg('path', { d: `M12 ${height - 12}h${bar.toFixed(1)}m0 -4v8m${(-bar).toFixed(1)} -8v8` }),
    svg('text', { x: 12 + bar + 8, y: height - 8 }, `${plain(step)} ${lengthUnit(run)}`)));
  return svg('svg', { class: 'plan', viewBox: `0 0 ${kWidth} ${height.toFixed(1)}`, role: 'img', 'aria-label': 'Path from above' }, ...children);
}

function legend(run: Run, truth: boolean): HTMLElement {
  const entry = (name: string, text: string, kind = '') => h('li', {},
    h('span', { class: `swatch ${kind}`, style: `--swatch: var(--${name})` }), text);
  return h('ul', { class: 'legend' }, entry('path', 'estimate'), truth && entry('truth', 'ground truth'),
    entry('keyframe', 'keyframe', 'dot'), entry('path', 'start', 'ring'), entry('path', 'end', 'square'),
    run.summary.loops.length > 0 && entry('loop', 'loop closure', 'ring'),
    run.summary.frames.lost_intervals.length > 0 && entry('lost', 'not tracked', 'dashed'));
}

// One drawing per submap that has a path.
export function planSection(run: Run): HTMLElement[] {
  const usable = run.truth && !run.truth.error ? run.truth.path : null;
  const shown = run.submaps.map((submap, i) => ({ submap, i })).filter(({ submap }) => submap.path.time.length > 1);
  if (!shown.length) return [h('p', {}, 'There is no path: no two frames could be tracked.')];
  return [legend(run, usable !== null), ...shown.map(({ submap, i }) => h('figure', {},
    shown.length > 1 && h('figcaption', {}, `Submap ${i + 1}: ${plural(submap.frames, 'frame')}, in its own world frame`),
    drawing(run, submap, i === 0 ? usable : null)))];
}
