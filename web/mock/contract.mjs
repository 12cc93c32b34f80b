/** A small judge of JSON against the gateway's OpenAPI document: what is missing, what is not in it, what has the wrong type. */
import { readFileSync } from 'node:fs';

const { components } = JSON.parse(readFileSync(new URL('../src/api/openapi.json', import.meta.url), 'utf8'));

const typeOf = (value) => (value === null ? 'null' : Array.isArray(value) ? 'array' : Number.isInteger(value) ? 'integer' : typeof value);

/** Faults of `value` by the named schema, each with its path; none when it is right. */
export const faults = (name, value) => judge({ $ref: `#/components/schemas/${name}` }, value, name);

function judge(schema, value, path) {
  if (schema.$ref) return judge(components.schemas[schema.$ref.split('/').at(-1)], value, path);
  if (schema.allOf) return schema.allOf.flatMap((part) => judge(part, value, path));
  if (schema.oneOf) {
    const all = schema.oneOf.map((part) => judge(part, value, path));
    return all.some((one) => one.length === 0) ? [] : all.toSorted((a, b) => a.length - b.length)[0];
  }
  if (schema.enum && !schema.enum.includes(value)) return [`${path}: ${JSON.stringify(value)} is none of ${schema.enum.join(', ')}`];
  const types = [schema.type ?? []].flat();
  const type = typeOf(value);
  if (types.length > 0 && !types.includes(type) && !(type === 'integer' && types.includes('number'))) return [`${path}: ${type} instead of ${types.join(' or ')}`];
  if (type === 'array') return value.flatMap((one, i) => judge(schema.items ?? {}, one, `${path}[${i}]`));
  if (type !== 'object' || !schema.properties) return [];
  return [
    ...(schema.required ?? []).filter((key) => !(key in value)).map((key) => `${path}.${key} is missing`),
    ...Object.keys(value).filter((key) => !(key in schema.properties)).map((key) => `${path}.${key} is not in the contract`),
    ...Object.entries(value).flatMap(([key, one]) => (schema.properties[key] ? judge(schema.properties[key], one, `${path}.${key}`) : [])),
  ];
}
