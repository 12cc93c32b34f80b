/** A random 128-bit name. `crypto.randomUUID` exists only in secure contexts, and a tablet at the water's edge opens the page
 * over plain HTTP by the station's address. */
export function randomId(): string {
  return Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16).padStart(2, '0')).join('');
}
