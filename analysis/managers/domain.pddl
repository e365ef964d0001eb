; Functions, and designs that solve them. Written for suave-des from what is published of PLANTA; it is not PLANTA's own domain,
; which could not be copied. Our own, too, are the costs: see planta.py.
(define (domain suave)
  (:requirements :strips :typing :action-costs)
  (:types function design)
  (:predicates
    (solves ?design - design ?function - function)
    (realisable ?design - design)
    (idle ?function - function)
    (in_use ?function - function ?design - design)
    (performed ?function - function))
  (:functions
    (total-cost) - number
    (shortfall ?design - design) - number)
  (:action ground
    :parameters (?function - function ?design - design)
    :precondition (and (solves ?design ?function) (realisable ?design) (idle ?function))
    :effect (and (not (idle ?function)) (in_use ?function ?design) (increase (total-cost) 10)))
  (:action reconfigure
    :parameters (?function - function ?from - design ?to - design)
    :precondition (and (solves ?to ?function) (realisable ?to) (in_use ?function ?from))
    :effect (and (not (in_use ?function ?from)) (in_use ?function ?to) (increase (total-cost) 10)))
  (:action perform
    :parameters (?function - function ?design - design)
    :precondition (and (in_use ?function ?design) (realisable ?design))
    :effect (and (performed ?function) (increase (total-cost) (shortfall ?design)))))
