# msgflow in a container: `docker build -t msgflow .`; the README says how to give it a folder.
FROM python:3.12-slim AS build
WORKDIR /source
COPY pyproject.toml README.md LICENSE ./
COPY packaging packaging
COPY msgflow msgflow
COPY schema schema
COPY migrations migrations
COPY queries queries
COPY docs/cookbook.md docs/cookbook.md
RUN python -m venv /opt/msgflow && /opt/msgflow/bin/pip install --no-cache-dir .

FROM python:3.12-slim
COPY --from=build /opt/msgflow /opt/msgflow
# No user's home: `--user` may name any user.
ENV PATH=/opt/msgflow/bin:$PATH HOME=/tmp PYTHONUNBUFFERED=1
RUN useradd --no-create-home --uid 1000 msgflow && mkdir /data && chown msgflow /data
USER msgflow
WORKDIR /data
ENTRYPOINT ["msgflow"]
