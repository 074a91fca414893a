# Renders without a GPU: Mesa's llvmpipe. `make image`, then
#   docker run --rm --user "$(id -u)" --volume "$PWD:/work" defshade render shot.usd -o shot.png
FROM debian:stable-slim AS build
RUN apt-get update && apt-get install --yes --no-install-recommends make python3 python3-venv
WORKDIR /src
COPY . .
RUN make wheel && python3 -m venv /opt/defshade \
    && /opt/defshade/bin/pip install --no-cache-dir "$(ls dist/*.whl)[meshoptimizer]"

FROM debian:stable-slim
RUN apt-get update \
    && apt-get install --yes --no-install-recommends python3 libegl1 libgl1 libgl1-mesa-dri \
    && rm -rf /var/lib/apt/lists/*
COPY --from=build /opt/defshade /opt/defshade
ENV PATH=/opt/defshade/bin:$PATH
WORKDIR /work
RUN defshade doctor
ENTRYPOINT ["defshade"]
