// The time that is selected on the page: by the slider of the map, or by pointing at a chart.
const listeners = new Set<(time: number) => void>();

export function selectTime(time: number) {
  for (const listener of listeners) listener(time);
}

export function onTime(listener: (time: number) => void): () => void {
  listeners.add(listener);
  return () => listeners.delete(listener);
}
