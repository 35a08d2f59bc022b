// One panel per camera: keypoints, matched landmarks and inliers over time, and the intervals in which it was not ok.
import { addChart } from './charts';
import { quantile, Run } from './data';
import { decimal, h, integer, seconds } from './dom';
import { cameraColour } from './theme';
import { stateColour, stateText } from './timeline';

const kMaxListed = 4;

function states(run: Run, camera: number): HTMLElement {
  const faults = run.summary.cameras[camera].states.filter((s) => s.state !== 'ok');
  if (!faults.length) return h('p', { class: 'states' }, 'ok during the whole run');
  const listed = faults.slice(0, kMaxListed).map((s) => `${stateText(s)} ${seconds(s.from)} to ${seconds(s.to)}`).join('; ');
  return h('p', { class: 'states' }, listed, faults.length > kMaxListed && `; and ${faults.length - kMaxListed} more intervals`);
}

export function camerasSection(run: Run, parent: HTMLElement): (() => void)[] {
  const panels = h('div', { class: 'panels' });
  parent.append(panels);
  return run.frames.cameras.map((counts, c) => {
    const camera = run.summary.cameras[c], rig = run.rig[c];
    const share = camera.reprojection.inlier_share;
    const panel = h('section', { class: 'panel' },
      h('h3', {}, h('span', { class: 'swatch', style: `--swatch: var(--${cameraColour(c)})` }), camera.name,
        h('small', {}, ` ${rig.model}, ${rig.width} × ${rig.height}`)),
      h('p', { class: 'states' }, `median ${integer(quantile(counts.inliers, 0.5))} inliers`,
        share !== null && `, ${decimal(100 * share, 1)} % of the matches`,
        camera.skipped > 0 && `, ${integer(camera.skipped)} damaged images`));
    panels.append(panel);
    const strip = camera.states.filter((s) => s.state !== 'ok').map((s) => ({ from: s.from, to: s.to, colour: stateColour(s.state) }));
    const remove = addChart(panel, run, {
      label: `${camera.name}: keypoints, matched landmarks and inliers over time`, unit: 'per image', height: 190,
      time: run.frames.time, strip,
      marks: run.summary.loops.map((loop) => ({ at: loop.at, colour: 'loop' })),
      lines: [
        { label: 'keypoints', values: counts.keypoints, colour: 'soft', width: 1, points: run.frames.direct > 0 },
        { label: 'matched', values: counts.matched, colour: 'matched', width: 1.2 },
        { label: 'inliers', values: counts.inliers, colour: 'inliers', width: 2 },
      ],
    });
    panel.append(states(run, c));
    return remove;
  });
}
