-- title: A row has several partners, or two that belong together do not name each other
-- description: A publication has one direct cause at most. A subscription receives it at most once
--     by each way: through the ring buffer of its process, and through the middleware, whose copy
--     it drops; only a poll of Agnocast may get again what it got before. A take comes from one
--     publication at most, and leads to one callback instance. A request and its callback instance
--     name each other. What a thread sent after a taken request or response has one cause, and is
--     one message.
-- cause: A mistake in msgflow, or input that it misunderstands.
-- cure: Report what msgflow check --detail prints, together with the trace.
-- grain: one row per run and kind of such rows
-- severity: error
WITH call AS (
    SELECT
        run_id, publication_id, request_id, response_id,
        list_count([taken_request_id, taken_response_id]) = 1
        AND list_count([publication_id, request_id, response_id]) = 1 AS is_one
    FROM store.link_call
),
wrong AS (
    SELECT
        run_id,
        'publications with several direct causes' AS detail
    FROM store.link_causal
    WHERE kind = 'direct'
    GROUP BY run_id, publication_id
    HAVING count(*) > 1
    UNION ALL
    SELECT run_id, 'publications that a subscription took several times in one way'
    FROM store.link_transport
    WHERE subscription_id IS NOT NULL AND method <> 'agnocast'
    GROUP BY run_id, publication_id, subscription_id, method = 'ring_buffer'
    HAVING count(*) > 1
    UNION ALL
    SELECT run_id, 'takes with several publications'
    FROM store.link_transport
    GROUP BY run_id, take_id
    HAVING count(*) > 1
    UNION ALL
    SELECT run_id, 'takes with several callback instances'
    FROM store.callback_instance
    WHERE take_id IS NOT NULL
    GROUP BY run_id, take_id
    HAVING count(*) > 1
    UNION ALL
    SELECT
        coalesce(q.run_id, i.run_id),
        'requests and callback instances that do not name each other'
    FROM store.request AS q
    FULL JOIN (SELECT * FROM store.callback_instance WHERE request_id IS NOT NULL) AS i
        ON q.request_id = i.request_id
    WHERE q.callback_instance_id IS DISTINCT FROM i.callback_instance_id
    UNION ALL
    SELECT run_id, 'links without just one cause and one effect' FROM call WHERE NOT is_one
    UNION ALL
    SELECT run_id, 'links without just one cause and one effect'
    FROM call
    WHERE is_one
    GROUP BY run_id, publication_id, request_id, response_id
    HAVING count(*) > 1
)
SELECT
    run_id,
    count(*) AS count,
    detail
FROM wrong
GROUP BY run_id, detail
