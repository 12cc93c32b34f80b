//! Stories across services, mesh and fault tests, the layering test
