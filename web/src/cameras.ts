// One panel per camera: keypoints, matched landmarks and inliers over time, and the intervals in which it was not ok.
import { addChart, ChartOptions } from './charts';
import { quantile, Run } from './data';
import { decimal, h, integer, seconds } from './dom';
import { morph } from './morph';
import { Drawing } from './section';
import { cameraColour } from './theme';
import { stateColour, stateText } from './timeline';

const kMaxListed = 4;

function states(run: Run, camera: number): HTMLElement {
  const faults = run.summary.cameras[camera].states.filter((s) => s.state !== 'ok');
  if (!faults.length) return h('p', { class: 'states' }, run.live ? 'ok until now' : 'ok during the whole run');
  const listed = faults.slice(0, kMaxListed).map((s) => `${stateText(s)} ${seconds(s.from)} to ${seconds(s.to)}`).join('; ');
  return h('p', { class: 'states' }, listed, faults.length > kMaxListed && `; and ${faults.length - kMaxListed} more intervals`);
}

function chartOptions(run: Run, c: number): ChartOptions {
  const camera = run.summary.cameras[c], counts = run.frames.cameras[c];
  return {
    label: `${camera.name}: keypoints, matched landmarks and inliers over time`, unit: 'per image', height: 190, time: run.frames.time,
    strip: camera.states.filter((s) => s.state !== 'ok').map((s) => ({ from: s.from, to: s.to, colour: stateColour(s.state) })),
    marks: run.summary.loops.map((loop) => ({ at: loop.at, colour: 'loop' })),
    lines: [
      { label: 'keypoints', values: counts.keypoints, colour: 'soft', width: 1, points: run.frames.direct > 0 },
      { label: 'matched', values: counts.matched, colour: 'matched', width: 1.2 },
      { label: 'inliers', values: counts.inliers, colour: 'inliers', width: 2 },
    ],
  };
}

function counts(run: Run, c: number): HTMLElement {
  const camera = run.summary.cameras[c], share = camera.reprojection.inlier_share;
  return h('p', { class: 'states' }, `median ${integer(quantile(run.frames.cameras[c].inliers, 0.5))} inliers`,
    share !== null && `, ${decimal(100 * share, 1)} % of the matches`,
    camera.skipped > 0 && `, ${integer(camera.skipped)} damaged images`);
}

export function camerasSection(run: Run, parent: HTMLElement): Drawing {
  const panels = h('div', { class: 'panels' });
  parent.append(panels);
  const cameras = run.frames.cameras.map((_, c) => {
    const rig = run.rig[c], above = h('div', {}, counts(run, c)), below = h('div', {}, states(run, c));
    const panel = h('section', { class: 'panel' },
      h('h3', {}, h('span', { class: 'swatch', style: `--swatch: var(--${cameraColour(c)})` }), run.summary.cameras[c].name,
        h('small', {}, ` ${rig.model}, ${rig.width} × ${rig.height}`)), above);
    panels.append(panel);
    const chart = addChart(panel, run, chartOptions(run, c));
    panel.append(below);
    return {
      update: (newer: Run) => {
        morph(above, [counts(newer, c)]);
        morph(below, [states(newer, c)]);
        chart.update(newer, chartOptions(newer, c));
      },
      remove: chart.remove,
    };
  });
  return { update: (newer) => cameras.forEach((c) => c.update(newer)), remove: () => cameras.forEach((c) => c.remove()) };
}
