/** Light or dark: as the device says, unless a person chose. */
import { computed, effect, signal } from '@preact/signals';

export type ThemeChoice = 'auto' | 'light' | 'dark';

const KEY = 'halcyon-theme';
const stored = (): ThemeChoice => {
  try {
    const text = localStorage.getItem(KEY);
    return text === 'light' || text === 'dark' ? text : 'auto';
  } catch {
    // Storage may be forbidden; the choice then lasts as long as the page.
    return 'auto';
  }
};

const deviceDark = matchMedia('(prefers-color-scheme: dark)');
const dark = signal(deviceDark.matches);
deviceDark.addEventListener('change', (event) => (dark.value = event.matches));

export const themeChoice = signal<ThemeChoice>(stored());
export const theme = computed<'light' | 'dark'>(() => (themeChoice.value === 'auto' ? (dark.value ? 'dark' : 'light') : themeChoice.value));

effect(() => {
  document.documentElement.dataset['theme'] = theme.value;
  try {
    if (themeChoice.value === 'auto') localStorage.removeItem(KEY);
    else localStorage.setItem(KEY, themeChoice.value);
  } catch {
    // As above.
  }
});

export const nextTheme = (): void => {
  const order: ThemeChoice[] = ['auto', 'light', 'dark'];
  themeChoice.value = order[(order.indexOf(themeChoice.value) + 1) % order.length] ?? 'auto';
};
