import { describe, expect, it } from 'vitest';
import { UNKNOWN, age, countdown, fixed, fixKind, heading, latLon, length, percent, quantity, waveHeight, words } from './format';

const plain = (text: string): string => text.replaceAll('\u202f', ' ');

describe('numbers for people', () => {
  it('never turns an unknown into a number', () => {
    for (const show of [length, waveHeight, age, heading, percent]) {
      expect(show(null)).toBe(UNKNOWN);
      expect(show(undefined)).toBe(UNKNOWN);
      expect(show(Number.NaN)).toBe(UNKNOWN);
    }
    expect(fixKind(null)).toBe(UNKNOWN);
    expect(quantity(Number.POSITIVE_INFINITY, 1, 'm')).toBe(UNKNOWN);
  });

  it.each([
    [-0.04, 1, '0.0'],
    [-0.05, 2, '\u22120.05'],
    [2.25, 1, '2.3'],
  ])('%d with %i decimals is %s', (value, digits, text) => expect(fixed(value, digits)).toBe(text));

  it.each([
    [0, '0.0 m'],
    [-3.21, '\u22123.2 m'],
    [123.4, '123 m'],
    [1500, '1.5 km'],
    [23_400, '23 km'],
  ])('%d m reads %s', (value, text) => expect(plain(length(value))).toBe(text));

  it('shows a wave height in centimetres', () => expect(plain(waveHeight(0.0523))).toBe('5.2 cm'));

  it.each([
    [-0.2, 'now'],
    [0.99, 'now'],
    [2.34, '2.3 s'],
    [59.9, '59 s'],
    [150, '2 min'],
    [7300, '2 h'],
  ])('%d s ago reads %s', (value, text) => expect(plain(age(value))).toBe(text));

  it.each([
    [65.9, '1:05 min'],
    [59.99, '59 s'],
    [0.9, '0 s'],
    [-4, '0 s'],
  ])('%d s left reads %s: never more than there is', (value, text) => expect(plain(countdown(value))).toBe(text));

  it.each([
    [359.7, '000°'],
    [7, '007°'],
    [-90, '270°'],
  ])('heading %d reads %s', (value, text) => expect(heading(value)).toBe(text));

  it('names hemispheres', () => expect(latLon(-33.5, 151.25)).toBe('33.500000° S, 151.250000° E'));
  it('opens up names', () => expect(words('awaiting_approval')).toBe('Awaiting approval'));
  it('names a fix that it has never heard of', () => {
    expect(fixKind('rtk_fixed')).toBe('RTK fixed');
    expect(fixKind('quantum_link')).toBe('Quantum link');
  });
});
