// The command and the settings: those that differ from their defaults, and all of them folded away.
import { Run, Setting } from './data';
import { h, table } from './dom';

const withUnit = (value: string, s: Setting) => (value === '' ? '(empty)' : value + (s.unit ? `\u202f${s.unit}` : ''));

export function settingsSection(run: Run): HTMLElement[] {
  const changed = run.settings.filter((s) => s.value !== s.default);
  const rows = run.settings.map((s) => [h('code', {}, s.key), withUnit(s.value, s), withUnit(s.default, s), s.help]);
  const all = table('All settings', ['setting', 'value', 'default', 'meaning'], rows);
  const found = h('span', { role: 'status' });
  const filter = h('input', { type: 'search', id: 'filter', autocomplete: 'off', input: () => {
    const words = filter.value.toLowerCase().split(/\s+/);
    const lines = [...all.querySelectorAll('tbody tr')] as HTMLElement[];
    for (const line of lines) line.hidden = !words.every((word) => line.textContent!.toLowerCase().includes(word));
    found.textContent = ` ${lines.filter((line) => !line.hidden).length} of ${lines.length}`;
  } });
  return [
    ...(run.command ? [h('pre', { class: 'command' }, h('code', {}, run.command))] : []),
    changed.length
      ? table('Settings that differ from the default', ['setting', 'value', 'default', 'meaning'],
        changed.map((s) => [h('code', {}, s.key), h('b', {}, withUnit(s.value, s)), withUnit(s.default, s), s.help]))
      : h('p', {}, 'All settings have their default values.'),
    h('details', {}, h('summary', {}, `All ${run.settings.length} settings`),
      h('p', { class: 'filter' }, h('label', { for: 'filter' }, 'Filter '), filter, found), all),
  ];
}
