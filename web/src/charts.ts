// Charts over the time of the run. They share the time axis and the cursor; dragging selects a time range, a double
// click shows all of it.
import uPlot from 'uplot';
import { selectTime } from './cursor';
import { Run, timeRange } from './data';
import { h, short } from './dom';
import { colour, onTheme } from './theme';

export interface Line {
  label: string;
  values: ArrayLike<number>;
  colour: string;  // name of a custom property
  width?: number;
  points?: boolean;
  fill?: boolean;
}

export interface Band { from: number; to: number; colour: string }

export interface ChartOptions {
  label: string;  // what the chart shows, for screen readers
  unit: string;
  height: number;
  time: Float32Array;
  lines: Line[];
  strip?: Band[];  // drawn along the bottom
  marks?: { at: number; colour: string }[];
}

const kFont = '12px system-ui, "Segoe UI", "Noto Sans", "Liberation Sans", sans-serif';

function shade(u: uPlot, band: Band, top: number, height: number) {
  const from = Math.max(u.valToPos(band.from, 'x', true), u.bbox.left);
  const to = Math.min(u.valToPos(band.to, 'x', true), u.bbox.left + u.bbox.width);
  if (to < u.bbox.left || from > u.bbox.left + u.bbox.width) return;
  u.ctx.fillStyle = colour(band.colour);
  u.ctx.fillRect(from, top, Math.max(to - from, 2 * devicePixelRatio), height);
}

function drawBackground(u: uPlot, run: Run) {
  u.ctx.save();
  for (const lost of run.summary.frames.lost_intervals) {
    shade(u, { from: lost.from, to: lost.to, colour: 'lost-ground' }, u.bbox.top, u.bbox.height);
  }
  u.ctx.restore();
}

function drawForeground(u: uPlot, options: ChartOptions) {
  const strip = 5 * devicePixelRatio;
  u.ctx.save();
  for (const band of options.strip ?? []) shade(u, band, u.bbox.top + u.bbox.height - strip, strip);
  for (const mark of options.marks ?? []) {
    const x = Math.round(u.valToPos(mark.at, 'x', true));
    if (x < u.bbox.left || x > u.bbox.left + u.bbox.width) continue;
    u.ctx.fillStyle = colour(mark.colour);
    u.ctx.fillRect(x, u.bbox.top, Math.max(1, devicePixelRatio), u.bbox.height);
  }
  u.ctx.restore();
}

function axes(options: ChartOptions): uPlot.Axis[] {
  const common = {
    font: kFont,
    stroke: () => colour('soft'),
    grid: { stroke: () => colour('rule'), width: 1 },
    ticks: { stroke: () => colour('rule'), width: 1, size: 4 },
  };
  return [
    { ...common, size: 26, gap: 3, grid: { show: false }, values: (_, ticks) => ticks.map((t) => `${+t.toFixed(3)} s`), space: 70 },
    { ...common, size: 46, gap: 4, values: (_, ticks) => ticks.map((v) => `${+v.toPrecision(6)}`), space: 34,
      label: options.unit, labelFont: kFont, labelSize: 18, labelGap: 0 },
  ];
}

function seriesOf(line: Line): uPlot.Series {
  return {
    label: line.label,
    stroke: () => colour(line.colour),
    fill: line.fill ? () => colour(`${line.colour}-ground`) : undefined,
    width: line.points ? 0 : line.width ?? 1.5,
    points: { show: line.points ?? false, size: 3, width: 0, fill: () => colour(line.colour) },
    value: (_, value) => short(value),
    spanGaps: false,
  };
}

function legend(lines: Line[]) {
  return h('ul', { class: 'legend' }, ...lines.map((line) => h('li', {},
    h('span', { class: line.points ? 'swatch dot' : 'swatch', style: `--swatch: var(--${line.colour})` }), line.label)));
}

export interface Chart {
  update: (run: Run, options: ChartOptions) => void;  // the same lines with other values; keeps a selected time range
  remove: () => void;
}

const gaps = (values: ArrayLike<number>) => Array.from(values, (v) => (Number.isNaN(v) ? null : v));
const dataOf = (options: ChartOptions) =>
  [Array.from(options.time), ...options.lines.map((line) => gaps(line.values))] as uPlot.AlignedData;

// Appends the chart to `parent`.
export function addChart(parent: HTMLElement, run: Run, options: ChartOptions): Chart {
  const host = h('div', { class: 'chart', role: 'img', 'aria-label': options.label });
  if (options.lines.length > 1) parent.append(legend(options.lines));
  parent.append(host);
  const whole = () => timeRange(run);
  const chart = new uPlot({
    width: Math.max(host.clientWidth, 200), height: options.height,
    legend: { show: false },
    padding: [8, 8, 0, 0],
    scales: { x: { time: false, range: (_, low, high) => (low === null || low === high ? whole() : [low, high]) },
              y: { range: (_, __, high) => [0, high > 0 ? high * 1.08 : 1] } },
    cursor: { sync: { key: 'time' }, y: false, points: { size: 6 }, drag: { x: true, y: false } },
    axes: axes(options),
    series: [{}, ...options.lines.map(seriesOf)],
    hooks: {
      drawClear: [(u) => drawBackground(u, run)],
      draw: [(u) => drawForeground(u, options)],
      setCursor: [(u) => {
        if (host.matches(':hover') && u.cursor.idx != null) selectTime(u.data[0][u.cursor.idx]);
      }],
    },
  }, dataOf(options), host);
  const resize = new ResizeObserver(() => chart.setSize({ width: host.clientWidth, height: options.height }));
  resize.observe(host);
  const stop = onTheme(() => chart.redraw(false, true));
  return {
    update: (newRun, newOptions) => {
      const { min, max } = chart.scales.x, before = chart.data[0];
      const zoomed = before.length > 1 && (min! > before[0] || max! < before[before.length - 1]);
      run = newRun;
      options = newOptions;
      chart.setData(dataOf(options), !zoomed);
      if (zoomed) chart.redraw();
    },
    remove: () => { stop(); resize.disconnect(); chart.destroy(); },
  };
}
