//! The wire contract between services: halcyon.v1 protobuf and its conversion to the model
