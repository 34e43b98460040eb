-- title: Paths that go on beyond the limits
-- description: Chains of topics go on, or have siblings, beyond the limits of the search for paths.
--     Those are missing among paths.
-- cause: The system has very many paths, or very long ones.
-- cure: Ask for part of them: e2e-latency with --from, --to, --max-depth or --max-paths.
-- grain: one row, if there are any
-- severity: warning
-- when: derive.many_chains
SELECT
    $run_id AS run_id,
    count(*) AS count,
    'chains of topics that go on or have siblings beyond the limits of path enumeration (give '
    || 'e2e-latency --from, --to, --max-depth or --max-paths), among them '
    || array_to_string(list(path ORDER BY path_id)[1:3], '; ') AS detail
FROM main.flow_path([$run_id], NULL, NULL)
WHERE is_cut
HAVING count(*) > 0
