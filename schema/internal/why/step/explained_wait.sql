-- title: Waits of callbacks, from what an explanation has by then
-- description: The step explained_wait of waits-pair, which looks again when inputs became ready.
-- grain: one row per callback instance that waited
-- reads: exact_arrival, ready_wait
FROM main.executor_wait_explained(
    $runs, arrivals := 'exact_arrival', waits := 'ready_wait', has_kernel := $has_kernel,
    has_teams := $has_teams
)
