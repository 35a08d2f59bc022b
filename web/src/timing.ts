// Processing time: per frame over the run, and the distribution of the calls of each stage.
import { addChart, ChartOptions } from './charts';
import { Run, Stage, Statistics } from './data';
import { decimal, h, integer, svg, table } from './dom';
import { morph } from './morph';
import { Drawing } from './section';

const kWidth = 240, kHeight = 16;

// The median as a dot, the range from it to the 95th percentile as a bar, and the maximum as a tick, on a logarithmic axis.
function rangeDrawing(s: Statistics, place: (ms: number) => number): SVGElement {
  const [median, p95, max] = [s.median, s.p95, s.max].map((v) => place(v ?? 0));
  return svg('svg', { class: 'range', viewBox: `0 0 ${kWidth} ${kHeight}`, width: kWidth, height: kHeight, 'aria-hidden': 'true' },
    svg('line', { class: 'whole', x1: median, x2: max, y1: 8, y2: 8 }),
    svg('line', { class: 'most', x1: median, x2: p95, y1: 8, y2: 8 }),
    svg('circle', { cx: median, cy: 8, r: 4 }),
    svg('line', { class: 'tick', x1: max, x2: max, y1: 3, y2: 13 }));
}

// Returns a logarithmic axis over all stages, and its ticks.
function axis(all: Statistics[]): { place: (ms: number) => number; ticks: number[] } {
  const values = all.flatMap((s) => [s.median ?? 0, s.max ?? 0]).filter((v) => v > 0);
  const low = Math.floor(Math.log10(Math.max(0.01, Math.min(...values, 1)))), high = Math.ceil(Math.log10(Math.max(...values, 10)));
  const place = (ms: number) => 6 + (kWidth - 12) * (Math.log10(Math.max(ms, 10 ** low)) - low) / (high - low);
  return { place, ticks: Array.from({ length: high - low + 1 }, (_, i) => 10 ** (low + i)) };
}

function axisDrawing({ place, ticks }: ReturnType<typeof axis>): SVGElement {
  const label = (ms: number) => (ms >= 1000 ? `${ms / 1000} s` : `${ms}`);
  return svg('svg', { class: 'range', viewBox: `0 0 ${kWidth} ${kHeight}`, width: kWidth, height: kHeight, role: 'img',
                      'aria-label': 'logarithmic axis in milliseconds' },
    ...ticks.map((ms, i) => svg('text', { x: place(ms), y: 12, 'text-anchor': i === 0 ? 'start' : i === ticks.length - 1 ? 'end' : 'middle' }, label(ms))));
}

const chartOptions = (run: Run): ChartOptions => ({
  label: 'Processing time per frame', unit: 'ms per frame', height: 170, time: run.frames.time,
  lines: [{ label: 'time per frame', values: run.frames.ms, colour: 'inliers', width: 1.2 }] });

function stagesTable(run: Run): Node[] {
  const { time, memory } = run.summary;
  const stages: [string, Stage | null, Statistics][] = run.stages.map((s) => [s.name, s, time.stages_ms[s.name]]);
  const frame: [string, Stage | null, Statistics] = ['frame, in all', null, { ...time.frame_ms, count: run.frames.ms.filter((v) => !Number.isNaN(v)).length }];
  const rows = [frame, ...stages.sort((a, b) => Number(a[1]!.background) - Number(b[1]!.background))];
  const scale = axis(rows.map((row) => row[2]));
  const body: (Node | string)[][] = rows.map(([name, stage, s]) => [
    name, stage === null ? 'caller' : stage.background ? 'background' : 'caller', integer(s.count),
    decimal(s.median, 2), decimal(s.p95, 2), decimal(s.max, 2), stage ? decimal(stage.total_ms / 1000, 2) : '', rangeDrawing(s, scale.place)]);
  body.push([h('small', {}, 'axis of the drawings'), '', '', '', '', '', '', axisDrawing(scale)]);
  return [table('Processing time of the stages',
    ['stage', 'thread', 'calls', 'median [ms]', '95 % [ms]', 'max [ms]', 'sum [s]', 'median, 95 %, max [ms]'], body, [2, 3, 4, 5, 6]),
    !run.live && h('p', { class: 'hint' }, `Start ${decimal(time.start_up_s, 2)} s, run ${decimal(time.wall_s, 2)} s`,
      memory.peak_mb !== null && `, peak memory ${integer(memory.peak_mb)} MB`, '.')].filter((part) => part !== false);
}

export function timingSection(run: Run, parent: HTMLElement): Drawing {
  const chart = addChart(parent, run, chartOptions(run)), stages = h('div', {}, ...stagesTable(run));
  parent.append(stages);
  return {
    update: (newer) => {
      chart.update(newer, chartOptions(newer));
      morph(stages, stagesTable(newer));
    },
    remove: chart.remove,
  };
}
