// What a reader should know first, in whole sentences: each with whether it is fine, worth a look, a problem,
// or a result without judgement.
import { isMetric, Run } from './data';
import { verdictSentence } from './calibration';
import { integer, metres, plural, seconds } from './dom';
import { stateText } from './timeline';

export interface Finding { grade: 'fine' | 'note' | 'problem' | 'result'; text: string; target: string }

function tracking(run: Run): Finding {
  const f = run.summary.frames, lost = f.lost_intervals;
  if (!f.tracked) return { grade: 'problem', text: 'No frame could be tracked.', target: 'events' };
  if (!f.lost) return { grade: 'fine', text: `All ${integer(f.tracked)} processed frames were tracked.`, target: 'timeline' };
  const longest = Math.max(...lost.map((l) => l.to - l.from));
  return {
    grade: f.lost > 0.05 * f.input ? 'problem' : 'note', target: 'events',
    text: `${plural(f.lost, 'frame')} of ${integer(f.input)} could not be tracked, in ${plural(lost.length, 'interval')}; the longest lasts ${seconds(longest)}.`,
  };
}

// Cameras that were not ok; one sentence for those with the same faults.
function faults(run: Run): Finding[] {
  const named = new Map<string, string[]>();
  for (const camera of run.summary.cameras) {
    const intervals = camera.states.filter((s) => s.state !== 'ok');
    if (!intervals.length) continue;
    const total = intervals.reduce((sum, s) => sum + s.to - s.from, 0), reasons = [...new Set(intervals.map(stateText))].join(', ');
    const text = `not ok ${total > 0 ? `for ${seconds(total)}` : 'in a single frame'} (${reasons}).`;
    named.set(text, [...(named.get(text) ?? []), camera.name]);
  }
  return [...named].map(([text, names]) => ({
    grade: 'note', target: 'timeline', text: `${names.join(', ')} ${names.length > 1 ? 'were' : 'was'} ${text}` }));
}

export function findings(run: Run): Finding[] {
  const { frames, cameras, calibration, map, complete, loops } = run.summary;
  const list: Finding[] = [];
  if (!complete) list.push({ grade: 'note', text: 'The run was interrupted; the results go as far as it did.', target: 'timeline' });
  list.push(tracking(run));
  if (frames.dropped) list.push({ grade: 'note', text: `${plural(frames.dropped, 'frame')} came too fast and were dropped.`, target: 'time' });
  if (frames.in_loaded_map !== null) {
    list.push({ grade: frames.in_loaded_map ? 'result' : 'problem', target: 'map',
                text: `The run continued a saved map; ${plural(frames.in_loaded_map, 'frame')} of ${integer(frames.input)} could be located in it.` });
  }
  if (run.submaps.length > 1) {
    list.push({ grade: 'note', text: `The map consists of ${run.submaps.length} submaps that could not be joined.`, target: 'map' });
  }
  if (!isMetric(run)) {
    list.push({ grade: 'note', text: map.scale === 'up-to-scale' ? 'The rig cannot observe the scale: lengths are in map units.'
      : 'The motion did not reveal the scale: lengths are in map units.', target: 'map' });
  }
  const contradicted = calibration.refined ? 'note' : 'problem';  // a refined calibration has replaced it
  const grade = { consistent: 'fine', inconsistent: contradicted, unknown: 'note' } as const;
  list.push({ grade: grade[calibration.verdict], text: verdictSentence(run), target: 'calibration' });
  list.push(...faults(run));
  const warnings = run.summary.warnings.length;
  if (warnings) list.push({ grade: 'note', text: `The run printed ${plural(warnings, 'warning')}.`, target: 'warnings' });
  const foreign = calibration.pairs.some((p) => p.contradicted);
  const suspect = cameras.filter((c) => !foreign && c.extrinsics?.suspect).map((c) => c.name);
  if (suspect.length) list.push({ grade: contradicted, text: `The extrinsics are suspect: ${suspect.join(', ')}.`, target: 'calibration' });
  if (loops.length) list.push({ grade: 'result', text: `${plural(loops.length, 'loop')} closed.`, target: 'events' });
  const truth = run.truth;
  if (truth && !truth.error) {
    list.push({ grade: 'result', text: `Against ground truth the path is off by ${metres(truth.ate_m.rmse)} (rms, after alignment).`, target: 'truth' });
  }
  return list;
}
