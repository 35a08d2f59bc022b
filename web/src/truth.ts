// Errors against the ground truth of the data set.
import { addChart, ChartOptions } from './charts';
import { lengthUnit, Run } from './data';
import { decimal, h, integer, metres, plain } from './dom';
import { morph } from './morph';
import { Drawing } from './section';

function figuresOf(run: Run): HTMLElement {
  const truth = run.truth!;
  const figure = (name: string, value: string, note: string) => h('div', {}, h('dt', {}, name), h('dd', {}, value, h('small', {}, ` ${note}`)));
  return h('dl', { class: 'figures wide' },
    figure('position error, rms', metres(truth.ate_m.rmse), `median ${metres(truth.ate_m.median)}, max ${metres(truth.ate_m.max)}`),
    figure(`drift over ${plain(truth.rpe_delta_s)} s, rms`, metres(truth.rpe_m.rmse), truth.rpe_m.rmse === null ? 'the run is shorter' : `and ${decimal(truth.rpe_deg.rmse, 3)}°`),
    figure('scale', decimal(truth.scale, 4), 'truth / estimate'),
    figure('coverage', `${decimal(truth.coverage === null ? null : 100 * truth.coverage, 1)} %`, `${integer(truth.ate_m.count)} poses`));
}

function chartOptions(run: Run): ChartOptions {
  const truth = run.truth!;
  return {
    label: 'Position error over time', unit: `error [${lengthUnit(run) === 'm' ? 'm' : 'm, aligned'}]`, height: 180, time: truth.time,
    lines: [{ label: 'position error', values: truth.error_m, colour: 'inliers', width: 1.5, fill: true }] };
}

export function truthSection(run: Run, parent: HTMLElement): Drawing {
  const truth = run.truth!;
  if (truth.error) {
    parent.append(h('p', {}, `The ground truth of the data set could not be used: ${truth.error}`));
    return { update: () => {}, remove: () => {} };
  }
  if (truth.note) parent.append(h('p', {}, truth.note));
  const figures = h('div', {}, figuresOf(run));
  parent.append(figures);
  const chart = addChart(parent, run, chartOptions(run));
  return {
    update: (newer) => {
      if (!newer.truth || newer.truth.error) return;
      morph(figures, [figuresOf(newer)]);
      chart.update(newer, chartOptions(newer));
    },
    remove: chart.remove,
  };
}
