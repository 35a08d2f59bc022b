// Sections of the page. They are drawn once and updated with newer data of the run.
import { Run } from './data';
import { morph } from './morph';

export interface Drawing {
  update: (run: Run) => void;
  remove: () => void;
}

export type Draw = (run: Run, body: HTMLElement) => Drawing;

// A section of elements without listeners.
export const fromElements = (make: (run: Run) => Node[]): Draw => (run, body) => {
  body.append(...make(run));
  return { update: (newer) => morph(body, make(newer)), remove: () => {} };
};

// A section that is made anew when the data it depends on have changed.
export const remade = (make: (run: Run) => Node[], data: (run: Run) => unknown): Draw => (run, body) => {
  let shown = JSON.stringify(data(run));
  body.append(...make(run));
  return {
    update: (newer) => {
      const text = JSON.stringify(data(newer));
      if (text !== shown) body.replaceChildren(...make(newer));
      shown = text;
    },
    remove: () => {},
  };
};
