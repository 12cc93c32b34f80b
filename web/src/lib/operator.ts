/** Who sits at this page, for the record: sent with every command, kept on this device. */
import { effect, signal } from '@preact/signals';

const KEY = 'halcyon-operator';
/** What the record says when nobody gave a name. */
const NOBODY = 'dashboard';
const LENGTH_MAX = 64;

/** What the gateway takes: printable ASCII without blanks at the ends. Letters with marks lose the marks, others go. */
export function operatorHeader(name: string): string {
  const plain = name.normalize('NFKD').replace(/[^ -~]/g, '').trim().slice(0, LENGTH_MAX).trim();
  return plain === '' ? NOBODY : plain;
}

function stored(): string {
  try {
    return localStorage.getItem(KEY) ?? '';
  } catch {
    return '';
  }
}

export const operator = signal(stored());

effect(() => {
  try {
    localStorage.setItem(KEY, operator.value);
  } catch {
    // Storage may be forbidden; the name then lasts as long as the page.
  }
});
