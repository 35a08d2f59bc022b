// What happened when: tracking, events and the states of all cameras as bands over the time of the run.
import { onTime, selectTime } from './cursor';
import { CameraInterval, Run, timeRange } from './data';
import { h, seconds } from './dom';
import { morph } from './morph';
import { Drawing } from './section';

interface Piece { from: number; to: number; kind: string; text: string }

// Text of a state: "out: black".
export const stateText = (interval: CameraInterval) => interval.state + (interval.reason ? `: ${interval.reason}` : '');

export const stateColour = (state: string) => (state === 'out' ? 'out' : state === 'degraded' ? 'degraded' : 'ok');

// The bands, and what places a time on them.
function bands(run: Run): { rows: Node[]; percent: (t: number) => string } {
  const [from, to] = timeRange(run), width = to - from, times = run.frames.time;
  const interval = times.length > 1 ? width / (times.length - 1) : width;
  const percent = (t: number) => `${(100 * Math.min(1, Math.max(0, (t - from) / width))).toFixed(3)}%`;
  const row = (label: string, pieces: Piece[]) => [
    h('span', { class: 'label' }, label),
    h('div', { class: 'track' }, ...pieces.map((p) => h('span', {
      class: `piece ${p.kind}`, title: `${p.text}, ${seconds(p.from)}${p.to > p.from ? ` to ${seconds(p.to)}` : ''}`,
      style: `left: ${percent(p.from)}; width: ${p.to > p.from ? `calc(${percent(from + p.to - p.from)})` : '2px'}` },
      p.to - p.from > 0.1 * width && p.kind !== 'ok' ? p.text : null)))];
  const lost = run.summary.frames.lost_intervals.map((l) => ({ from: l.from - interval / 2, to: l.to + interval / 2, kind: 'lost', text: `lost: ${l.reason}` }));
  const instants = (list: { at: number }[], kind: string, text: string) => list.map((e) => ({ from: e.at, to: e.at, kind, text }));
  const keyframes = run.submaps.flatMap((s) => (s.loaded ? [] : Array.from(s.keyframes.time))).map((at) => ({ at }));
  const rows = [
    ...row('tracking', [{ from, to, kind: 'ok', text: 'tracked' }, ...lost]),
    ...row('keyframes', instants(keyframes, 'tick', 'keyframe')),
    ...(run.summary.loops.length ? row('loops', instants(run.summary.loops, 'loop', 'loop closure')) : []),
    ...(run.summary.relocalisations.length ? row('relocalised', instants(run.summary.relocalisations, 'relocalised', 'relocalised')) : []),
    ...run.summary.cameras.flatMap((camera) => row(camera.name, camera.states.map((s) => ({
      from: s.from - interval / 2, to: s.to + interval / 2, kind: stateColour(s.state), text: stateText(s) })))),
    h('span', {}), h('div', { class: 'ends' }, h('span', {}, seconds(from)), h('span', {}, seconds(to)))];
  return { rows, percent };
}

export function timelineSection(run: Run, parent: HTMLElement): Drawing {
  const cursor = h('div', { class: 'time-cursor', hidden: true }), overlay = h('div', { class: 'overlay' }, cursor);
  const rows = h('div', { class: 'timeline' });
  let shown = bands(run);
  rows.append(...shown.rows, overlay);
  parent.append(rows);
  const point = (event: Event) => {
    const box = rows.querySelector('.track')!.getBoundingClientRect(), x = (event as PointerEvent).clientX;
    const [from, to] = timeRange(run);
    if (x >= box.left && x <= box.right) selectTime(from + (to - from) * (x - box.left) / box.width);
  };
  rows.addEventListener('pointermove', point);
  const remove = onTime((time) => {
    cursor.hidden = !Number.isFinite(time);
    cursor.style.left = shown.percent(time);
  });
  const update = (newer: Run) => {
    run = newer;
    shown = bands(newer);
    overlay.remove();
    morph(rows, shown.rows);
    rows.append(overlay);
  };
  return { update, remove };
}
