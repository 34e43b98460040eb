-- title: Paths, the one that is explained first
-- description: Rows of e2e-latency of the application's paths: first the path that is explained,
--     then the slowest first.
-- grain: one row per path
-- reads: paths, application_path
-- param: path VARCHAR  The path; NULL: the slowest one
SELECT p.*
FROM paths AS p
WHERE p.path IN (SELECT path FROM application_path) OR NOT EXISTS (FROM application_path)
ORDER BY coalesce(p.path <> $path, true), p.p95_ns DESC NULLS LAST, p.path
