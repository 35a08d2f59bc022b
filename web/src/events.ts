// Lost intervals, loop closures and relocalisations in order of time.
import { Run } from './data';
import { decimal, h, integer, seconds, table } from './dom';

export function eventsSection(run: Run): HTMLElement[] {
  const { frames, loops, relocalisations } = run.summary;
  const events = [
    ...frames.lost_intervals.map((l) => ({ at: l.from, row: ['lost', `until ${seconds(l.to)}: ${l.reason}`] })),
    ...loops.map((l) => ({ at: l.at, row: ['loop closure', `with the place of ${seconds(l.with)}, ${integer(l.inliers)} inliers`] })),
    ...relocalisations.map((r) => ({ at: r.at, row: ['relocalised', `at the place of ${seconds(r.with)}, ${integer(r.inliers)} inliers`] })),
  ].sort((a, b) => a.at - b.at);
  if (!events.length) return [h('p', {}, 'Nothing was lost, and no place was recognised again.')];
  return [table('List of events', ['time [s]', 'event', 'details'], events.map((e) => [decimal(e.at, 2), ...e.row]))];
}
