// Elements and text. Text is always set as text, never parsed as HTML: names come from files of the user.

type Child = Node | string | null | undefined | false;
type Attributes = Record<string, string | number | boolean | ((event: Event) => void) | undefined>;

function fill(element: Element, attributes: Attributes, children: Child[]) {
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === 'function') element.addEventListener(name, value);
    else if (value !== undefined && value !== false) element.setAttribute(name, value === true ? '' : String(value));
  }
  for (const child of children) if (child !== null && child !== undefined && child !== false) element.append(child);
}

export function h<K extends keyof HTMLElementTagNameMap>(tag: K, attributes: Attributes = {}, ...children: Child[]) {
  const element = document.createElement(tag);
  fill(element, attributes, children);
  return element;
}

export function svg(tag: string, attributes: Attributes = {}, ...children: Child[]) {
  const element = document.createElementNS('http://www.w3.org/2000/svg', tag);
  fill(element, attributes, children);
  return element;
}

// A table that can be scrolled sideways where it is wider than the page. Numeric columns are aligned to the right.
export function table(label: string, head: string[], rows: (Child | Child[])[][], numeric: number[] = []) {
  const cell = (tag: 'th' | 'td', content: Child | Child[], column: number, attributes: Attributes = {}) =>
    h(tag, { ...attributes, class: numeric.includes(column) ? 'number' : undefined },
      ...(Array.isArray(content) ? content : [content]));
  return h('div', { class: 'scroll', role: 'region', 'aria-label': label, tabindex: 0 },
    h('table', {},
      h('thead', {}, h('tr', {}, ...head.map((text, i) => cell('th', text, i, { scope: 'col' })))),
      h('tbody', {}, ...rows.map((row) => h('tr', {},
        ...row.map((content, i) => (i === 0 ? cell('th', content, i, { scope: 'row' }) : cell('td', content, i))))))));
}

// ---- Numbers

const kThinSpace = '\u202f';

export function integer(value: number | null | undefined): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return '–';
  return String(Math.round(value)).replace(/\B(?=(\d{3})+$)/g, kThinSpace);
}

export function decimal(value: number | null | undefined, digits: number): string {
  return value === null || value === undefined || !Number.isFinite(value) ? '–' : value.toFixed(digits).replace('-', '\u2212');
}

// With about three significant digits.
export function short(value: number | null | undefined): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return '–';
  const magnitude = Math.abs(value);
  if (magnitude >= 1000) return integer(value);
  return decimal(value, magnitude >= 100 ? 0 : magnitude >= 10 ? 1 : magnitude >= 1 ? 2 : 3);
}

// A length in metres, in millimetres if it is small.
export function metres(value: number | null | undefined): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return '–';
  return value < 0.1 ? `${decimal(1000 * value, 1)}${kThinSpace}mm` : `${decimal(value, 3)}${kThinSpace}m`;
}

export const seconds = (value: number) => `${decimal(value, 2)}${kThinSpace}s`;
export const plural = (count: number, noun: string) => `${integer(count)} ${noun}${count === 1 ? '' : 's'}`;

// A round number, such as a tick, without superfluous digits.
export const plain = (value: number) => String(+value.toPrecision(6)).replace('-', '\u2212');

// The largest of 1, 2 and 5 times a power of ten that is not larger than `value`.
export function roundedDown(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value));
  return (value >= 5 * power ? 5 : value >= 2 * power ? 2 : 1) * power;
}
