# msgflow in a container: `docker build -t msgflow .`; the README says how to give it a folder.
FROM python:3.12-slim@sha256:78387bc3881b8273120a12ebe6c1ab22b018ccc2c9adf565ae1ac9b536e184ea AS build
WORKDIR /source
# What is installed is locked, with hashes; Dependabot renews the files.
COPY packaging packaging
RUN python -m venv /opt/build \
    && /opt/build/bin/pip install --no-cache-dir --require-hashes -r packaging/build.txt \
    && python -m venv /opt/msgflow \
    && /opt/msgflow/bin/pip install --no-cache-dir --require-hashes -r packaging/image.txt
COPY pyproject.toml README.md LICENSE ./
COPY msgflow msgflow
COPY schema schema
COPY migrations migrations
COPY queries queries
COPY docs/cookbook.md docs/cookbook.md
RUN /opt/build/bin/python -m build --wheel --no-isolation \
    && /opt/msgflow/bin/pip install --no-cache-dir --no-deps dist/*.whl

FROM python:3.12-slim@sha256:78387bc3881b8273120a12ebe6c1ab22b018ccc2c9adf565ae1ac9b536e184ea
COPY --from=build /opt/msgflow /opt/msgflow
# No user's home: `--user` may name any user.
ENV PATH=/opt/msgflow/bin:$PATH HOME=/tmp PYTHONUNBUFFERED=1
RUN useradd --no-create-home --uid 1000 msgflow && mkdir /data && chown msgflow /data
USER msgflow
WORKDIR /data
ENTRYPOINT ["msgflow"]
