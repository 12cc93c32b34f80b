#!/bin/sh
# Builds the fleet's image from the program that cargo built: docker.sh. BASE names another base image, IMAGE another name.
set -eu
context=target/docker
mkdir -p "$context"
strip -o "$context/halcyon" target/debug/halcyon
cp Dockerfile "$context/Dockerfile"
docker build --build-arg "BASE=${BASE:-debian:bookworm-slim}" -t "${IMAGE:-halcyon}" "$context"
