-- description: Threads that serve what came first first, as events executors do: of two messages
--     of two subscriptions that both waited, the older one was always taken first, in both orders
--     of the subscriptions. A wait set has one order of subscriptions: of 24 real executors with
--     such pairs, those with ten had taken the younger one first in a tenth to half of them. A
--     message may come later than one that was published up to a millisecond later, unless the
--     thread itself published both.
-- grain: one row per such thread
-- when: staging.queued_message
WITH served AS (
    SELECT
        m.thread_id, m.subscription_id, m.taken_ns, m.end_ns,
        CASE WHEN m.publishing_thread_id = m.thread_id THEN 0 ELSE 1_000_000 END AS margin_ns,
        lead(m.subscription_id) OVER on_thread AS next_subscription_id,
        lead(m.end_ns) OVER on_thread AS next_ns,
        lead(CASE WHEN m.publishing_thread_id = m.thread_id THEN 0 ELSE 1_000_000 END)
            OVER on_thread AS next_margin_ns
    FROM staging.queued_message AS m
    WINDOW on_thread AS (PARTITION BY m.thread_id ORDER BY m.start_event_id)
),
pair AS (
    SELECT
        thread_id, subscription_id,
        least(subscription_id, next_subscription_id) AS first_id,
        greatest(subscription_id, next_subscription_id) AS second_id,
        end_ns <= next_ns AS is_in_order
    FROM served
    WHERE subscription_id <> next_subscription_id
        AND abs(next_ns - end_ns) >= greatest(margin_ns, next_margin_ns)
        AND end_ns + margin_ns <= taken_ns
        AND next_ns + next_margin_ns <= taken_ns
),
couple AS (
    SELECT
        thread_id, count(*) FILTER (WHERE is_in_order) AS in_order,
        count(*) FILTER (WHERE NOT is_in_order) AS inverted,
        count(DISTINCT subscription_id) = 2 AS is_both_ways
    FROM pair
    GROUP BY thread_id, first_id, second_id
)
SELECT thread_id
FROM couple
GROUP BY thread_id
HAVING sum(in_order) >= 10 AND sum(inverted) = 0 AND bool_or(is_both_ways)
