// The verdict on the calibration, and how far the estimate from the images differs from it.
import { CalibratedCamera, Run } from './data';
import { decimal, h, table } from './dom';

export function verdictSentence(run: Run): string {
  const c = run.summary.calibration;
  const foreign = c.pairs.filter((p) => p.contradicted);
  const shares = (foreign.length ? foreign : c.pairs)
    .map((p) => p.cameras.join(' and ') + (p.matched_share === null ? '' : ` share ${decimal(100 * p.matched_share, 1)} % of the features in their common view`)).join('; ');
  if (foreign.length) {
    const effect = foreign[0].matched_share === null ? 'no map was started' : 'poses, scale and map are wrong';
    return `The images do not belong to the calibration, so ${effect}: ${shares}; ${foreign[0].evidence}.`;
  }
  if (c.verdict === 'unknown' && (shares || c.disagreeing.length)) {
    const disagreeing = c.disagreeing.map((name) => `${name} shows other things than the map predicts`);
    return `Whether the images agree with the calibration cannot be told: ${[shares, ...disagreeing].filter((text) => text).join('; ')}.`;
  }
  const excess = c.excess_error === null ? '' : ` With it the mean squared error is ${decimal(100 * c.excess_error, 1)} % larger than with the best estimate; the bound is ${decimal(100 * c.excess_bound, 1)} %.`;
  const texts = {
    consistent: `The images agree with the calibration.${excess}`,
    inconsistent: `The images contradict the calibration.${excess}`,
    unknown: 'The calibration could not be tested, which takes several cameras, enough motion and calibration.check.',
  };
  return texts[c.verdict] + (c.refined ? ' The map uses the calibration estimated from the images (rig_refined.yaml).' : '');
}

// A change with its standard deviation; a value that the images do not determine has none. A change of more than three
// standard deviations is set in bold.
function change(value: number, std: number | null, digits: number) {
  if (std === null) return [`${decimal(value, digits)} `, h('span', { class: 'unobserved' }, 'not observed')];
  const text = `${decimal(value, digits)} ± ${decimal(std, digits)}`;
  return [std > 0 && Math.abs(value) > 3 * std ? h('b', {}, text) : text];
}

function digitsFor(values: number[]): number {
  const smallest = Math.min(...values.filter((v) => v > 0));
  return Number.isFinite(smallest) ? Math.min(7, Math.max(1, 1 - Math.floor(Math.log10(smallest)))) : 4;
}

function extrinsics(cameras: CalibratedCamera[]) {
  const times = cameras.some((c) => c.time_offset_std_ms !== null || c.readout_std_ms !== null);
  const none = h('span', { class: 'unobserved' }, 'constant');
  const time = (value: number, std: number | null) => (std === null ? none.cloneNode(true) : change(value, std, 3));
  const rows = cameras.map((c, i) => [
    c.name,
    i === 0 ? 'reference' : change(c.rotation_deg, c.rotation_std_deg, 3),
    i === 0 ? 'reference' : change(c.translation_mm, c.translation_std_mm, 2),
    ...(times ? [time(c.time_offset_ms, c.time_offset_std_ms), time(c.readout_ms, c.readout_std_ms)] : []),
  ]);
  const head = ['camera', 'rotation [°]', 'translation [mm]', ...(times ? ['time offset [ms]', 'readout [ms]'] : [])];
  return table('Change of the extrinsics', head, rows, [1, 2, 3, 4]);
}

function intrinsics(cameras: CalibratedCamera[]) {
  const names = [...new Set(cameras.flatMap((c) => Object.keys(c.intrinsics)))];
  const rows = names.map((name) => {
    const all = cameras.map((c) => c.intrinsics[name]), digits = digitsFor(all.map((p) => p?.std ?? NaN));
    return [name, ...all.map((p) => (p ? change(p.change, p.std, digits) : '–'))];
  });
  return table('Change of the intrinsics', ['parameter', ...cameras.map((c) => c.name)], rows, cameras.map((_, i) => i + 1));
}

export function calibrationSection(run: Run): HTMLElement[] {
  const c = run.summary.calibration;
  const sentence = h('p', { class: `verdict ${c.verdict}` }, h('b', {}, c.verdict), ' ', verdictSentence(run));
  if (!c.cameras.length) return [sentence];
  return [sentence, h('h3', {}, 'Extrinsics, estimate minus calibration'), extrinsics(c.cameras),
          h('h3', {}, 'Intrinsics, estimate minus calibration'), intrinsics(c.cameras)];
}
