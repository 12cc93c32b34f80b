/** What is selected lives in the address, so that a reload, a bookmark or a link to a colleague shows the same. */
import { signal } from '@preact/signals';

export interface Selection {
  /** A mission's id, or `new` for the form. */
  mission: string | null;
  vehicle: string | null;
  rig: string | null;
  /** Which side panel a narrow screen shows. */
  tab: 'mission' | 'fleet' | 'events';
}

/** Reads the query part of an address; anything strange is ignored. */
export function readSelection(query: string): Selection {
  const parameters = new URLSearchParams(query);
  const id = (name: string): string | null => {
    const text = parameters.get(name);
    return text !== null && /^[A-Za-z0-9._-]{1,64}$/.test(text) ? text : null;
  };
  const tab = parameters.get('tab');
  return { mission: id('mission'), vehicle: id('vehicle'), rig: id('rig'), tab: tab === 'fleet' || tab === 'events' ? tab : 'mission' };
}

/** The inverse: `''` when all is default. */
export function writeSelection(selection: Selection): string {
  const parameters = new URLSearchParams();
  for (const name of ['mission', 'vehicle', 'rig'] as const) {
    const value = selection[name];
    if (value !== null) parameters.set(name, value);
  }
  if (selection.tab !== 'mission') parameters.set('tab', selection.tab);
  const text = parameters.toString();
  return text === '' ? '' : `?${text}`;
}

export const selection = signal<Selection>(readSelection(typeof location === 'undefined' ? '' : location.search));

/** Selects, and says so in the address; a mission is a step that "back" undoes. */
export function select(change: Partial<Selection>): void {
  const next = { ...selection.peek(), ...change };
  const query = writeSelection(next);
  if (query === writeSelection(selection.peek())) return;
  selection.value = next;
  const method = change.mission === undefined ? 'replaceState' : 'pushState';
  history[method](null, '', `${location.pathname}${query}`);
}

if (typeof addEventListener === 'function') {
  addEventListener('popstate', () => {
    selection.value = readSelection(location.search);
  });
}
