// Mean residuals over the image of every camera.
import { quantile, Residuals, Run } from './data';
import { decimal, h, integer, plain, plural, roundedDown, svg } from './dom';

const kMinObservations = 10;  // fewer say nothing about the mean
const kMinLongest = 0.15;     // pixels: shorter arrows are not magnified to look like errors

const counted = (r: Residuals) => Array.from(r.count, (n, i) => (n >= kMinObservations ? i : -1)).filter((i) => i >= 0);
const length = (r: Residuals, i: number) => Math.hypot(r.mean_px[2 * i], r.mean_px[2 * i + 1]);

// Root mean square of the mean residuals of the cells beyond what independent errors would leave of them.
function systematic(r: Residuals): number {
  let sum = 0, weight = 0;
  for (const i of counted(r)) {
    sum += r.count[i] * length(r, i) ** 2 - r.rms_px ** 2;
    weight += r.count[i];
  }
  return weight ? Math.sqrt(Math.max(0, sum / weight)) : NaN;
}

function drawing(r: Residuals, name: string, cellsPerPixel: number): SVGElement {
  const w = r.width / r.columns, hgt = r.height / r.rows, unit = r.width / 400;
  const cells: SVGElement[] = [];
  const used = counted(r);
  for (let c = 1; c < r.columns; ++c) cells.push(svg('line', { class: 'cell', x1: c * w, x2: c * w, y1: 0, y2: r.height }));
  for (let c = 1; c < r.rows; ++c) cells.push(svg('line', { class: 'cell', x1: 0, x2: r.width, y1: c * hgt, y2: c * hgt }));
  for (const i of used) {
    const x = (i % r.columns + 0.5) * w, y = (Math.floor(i / r.columns) + 0.5) * hgt, s = cellsPerPixel * w;
    const dx = s * r.mean_px[2 * i], dy = s * r.mean_px[2 * i + 1];
    cells.push(svg('line', { class: 'arrow', x1: x, y1: y, x2: x + dx, y2: y + dy, 'stroke-width': 2 * unit }),
      svg('circle', { class: 'foot', cx: x, cy: y, r: 2.4 * unit }));
  }
  return svg('svg', { class: 'residuals', viewBox: `${-unit} ${-unit} ${r.width + 2 * unit} ${r.height + 2 * unit}`, role: 'img',
                      'aria-label': `Mean residuals of ${name}` },
    svg('rect', { class: 'image', x: 0, y: 0, width: r.width, height: r.height, 'stroke-width': unit }), ...cells);
}

export function residualsSection(run: Run): HTMLElement[] {
  const lengths = run.residuals.flatMap((r) => counted(r).map((i) => length(r, i)));
  if (!lengths.length) return [h('p', {}, 'The map has too few observations.')];
  const longest = Math.max(quantile(lengths, 0.95), kMinLongest), bar = roundedDown(longest), cells = bar / longest;
  const panels = run.residuals.map((r, c) => {
    const name = run.summary.cameras[c].name;
    if (!r.observations) return h('figure', { class: 'panel' }, h('h3', {}, name), h('p', {}, 'no observations'));
    const scale = svg('svg', { class: 'bar', viewBox: '0 0 120 12', width: 120, height: 12, 'aria-hidden': 'true' },
      svg('line', { x1: 0, x2: 120, y1: 6, y2: 6 }));
    // The bar is as long as an arrow of `bar` pixels, relative to the width of the drawing.
    scale.setAttribute('style', `width: ${(100 * cells / r.columns).toFixed(2)}%`);
    scale.setAttribute('preserveAspectRatio', 'none');
    return h('figure', { class: 'panel' }, h('h3', {}, name),
      drawing(r, name, 1 / longest),
      h('div', { class: 'bar-line' }, scale, h('span', {}, `${plain(bar)} px`)),
      h('figcaption', {}, `rms ${decimal(r.rms_px, 2)} px over ${plural(r.observations, 'observation')}; systematic part ${decimal(systematic(r), 3)} px`,
        counted(r).length < r.count.length && `; ${integer(r.count.length - counted(r).length)} of ${r.count.length} cells have too few observations`));
  });
  return [h('div', { class: 'panels' }, ...panels)];
}
