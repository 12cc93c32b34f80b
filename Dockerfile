# The image of every container of a fleet: the programs, built on the host, and what they need to run.
# `make docker` builds it. BASE is any Debian 12; a local one will do: docker build --build-arg BASE=…
ARG BASE=debian:bookworm-slim
FROM ${BASE}
RUN apt-get update -qq \
 && apt-get install -y -qq --no-install-recommends \
      libopencv-calib3d406 libopencv-features2d406 libopencv-flann406 libopencv-imgcodecs406 libopencv-imgproc406 \
      libopencv-videoio406 libopencv-core406 libnetcdf19 libsqlite3-0 \
 && rm -rf /var/lib/apt/lists/* \
 && useradd --system --create-home --home-dir /var/lib/halcyon halcyon
COPY halcyon /usr/local/bin/halcyon
USER halcyon
WORKDIR /var/lib/halcyon
ENTRYPOINT ["halcyon"]
CMD ["--help"]
