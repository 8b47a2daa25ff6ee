tractiond simulation, version 1
# While the publishing thread got no processor, a client subscribed to previews repeatedly, left and connected again. Its
# end counted less than its subscriptions, and previews were made after it had left.
seed 1
lasts 8000 ms
3000 ms: previews 64 for 3000 ms
4000 ms: starved 3 for 600 ms
