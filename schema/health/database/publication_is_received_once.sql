-- title: A subscription received a publication twice in one way
-- description: A subscription receives a publication at most once by each way: through the ring
--     buffer of its process, and through the middleware, whose copy it drops. Only a poll of
--     Agnocast may get again what it got before.
-- cause: A mistake in msgflow, or input that it misunderstands.
-- cure: Report what msgflow check --detail prints, together with the trace.
-- grain: one row per run with such rows
-- severity: error
SELECT
    run_id,
    count(*) AS count,
    'publications that a subscription took several times in one way' AS detail
FROM (
    SELECT run_id
    FROM store.link_transport
    WHERE subscription_id IS NOT NULL AND method <> 'agnocast'
    GROUP BY run_id, publication_id, subscription_id, method = 'ring_buffer'
    HAVING count(*) > 1
)
GROUP BY run_id
