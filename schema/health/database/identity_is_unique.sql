-- title: Two rows have one identity
-- description: Publications, takes, callback instances, requests, responses and events of the user
--     have an identity of their own.
-- cause: A mistake in msgflow, or input that it misunderstands.
-- cure: Report what msgflow check --detail prints, together with the trace.
-- grain: one row per run and table
-- severity: error
WITH repeated AS (
    SELECT
        run_id,
        'publication' AS subject
    FROM store.publication
    GROUP BY run_id, publication_id
    HAVING count(*) > 1
    UNION ALL
    SELECT run_id, 'take' FROM store.take GROUP BY run_id, take_id HAVING count(*) > 1
    UNION ALL
    SELECT run_id, 'callback_instance'
    FROM store.callback_instance
    GROUP BY run_id, callback_instance_id
    HAVING count(*) > 1
    UNION ALL
    SELECT run_id, 'request' FROM store.request GROUP BY run_id, request_id HAVING count(*) > 1
    UNION ALL
    SELECT run_id, 'response' FROM store.response GROUP BY run_id, response_id HAVING count(*) > 1
    UNION ALL
    SELECT run_id, 'user_event'
    FROM store.user_event
    GROUP BY run_id, user_event_id
    HAVING count(*) > 1
)
SELECT
    run_id, subject,
    count(*) AS count,
    'identities that several rows have' AS detail
FROM repeated
GROUP BY run_id, subject
